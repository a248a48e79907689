"""A headless Chromium that loads pages and reports faults in them. Uses only Python's standard library."""

import base64
import json
import os
import pathlib
import shutil
import subprocess
import tempfile

# Evaluated in the page. Returns a list of [kind, what]; see Browser.faults() for the kinds.
CHECK = r"""
(() => {
  const faults = [];
  const fault = (kind, what) => faults.push([kind, String(what).slice(0, 200)]);
  const page = document.documentElement;
  if (page.scrollWidth > innerWidth) {
    const wide = [...document.body.querySelectorAll('*')].find(
        e => !e.closest('.scroll') && e.getBoundingClientRect().right > innerWidth + 1);
    fault('overflow', `${page.scrollWidth} px on a screen of ${innerWidth}: ${wide ? wide.outerHTML : '?'}`);
  }
  for (const table of document.querySelectorAll('table')) {
    const box = table.closest('.scroll');
    if (!box) fault('wide table', 'it has no box of its own: ' + table.outerHTML);
    else if (box.getBoundingClientRect().right > innerWidth + 1)
      fault('wide table', 'its box is wider than the screen');
    else if (box.scrollWidth > box.clientWidth + 1 && !/auto|scroll/.test(getComputedStyle(box).overflowX))
      fault('wide table', 'its last columns are hidden: ' + table.outerHTML);
  }
  const shown = e => e.getClientRects().length > 0;
  // Drawings are images: what is inside of them is looked at in copies that take their places.
  const copies = [...document.querySelectorAll('figure.drawing picture')].map(picture => {
    const image = picture.querySelector('img'), box = image.getBoundingClientRect();
    if (!image.complete || image.naturalWidth === 0 || box.height < 80) fault('missing plot', image.alt);
    const bytes = Uint8Array.from(atob(image.currentSrc.split(',')[1]), c => c.charCodeAt(0));
    const text = new TextDecoder().decode(bytes).replace(/<style>.*?<\/style>/s, '');
    const svg = document.importNode(new DOMParser().parseFromString(text, 'image/svg+xml').documentElement, true);
    svg.setAttribute('aria-label', image.alt);
    svg.style.width = '100%';
    svg.style.background = getComputedStyle(image).backgroundColor;
    svg.style.color = 'black';
    picture.style.display = 'none';
    picture.before(svg);
    return [picture, svg];
  });
  const middle = r => ({x: (r.left + r.right) / 2, y: (r.top + r.bottom) / 2});
  for (const figure of document.querySelectorAll('figure.drawing')) {
    const caption = figure.querySelector('figcaption');
    if (!caption || !caption.textContent.trim()) fault('no caption', figure.outerHTML);
    const drawings = [...figure.querySelectorAll('svg')].filter(shown);
    if (drawings.length !== 1) { fault('missing plot', caption && caption.textContent); continue; }
    const svg = drawings[0];
    const box = svg.getBoundingClientRect();
    if (box.width < 0.8 * figure.clientWidth || box.height < 80) fault('missing plot', `${box.width} x ${box.height}`);
    if (!svg.getAttribute('aria-label')) fault('no caption', svg.outerHTML);
    const area = r => r.width * r.height;
    const shapes = [...svg.querySelectorAll('path,polygon,polyline,image,use,circle,rect')]
      .filter(e => !e.closest('defs'));
    const isData = e => e.closest('[id*="gnuplot_plot_"]');
    // gnuplot draws a curve's sample in the key as part of the curve: what counts lies within the frame.
    const frame = shapes.filter(e => !isData(e)).map(e => e.getBoundingClientRect()).reduce(
        (a, b) => area(b) > area(a) && area(b) < 0.99 * area(box) ? b : a, new DOMRect());
    const drawn = shapes.filter(isData).filter(e => {
      const r = e.getBoundingClientRect(), m = middle(r);
      return r.width + r.height > 0 && m.x >= frame.left - 1 && m.x <= frame.right + 1 && m.y >= frame.top - 1 &&
             m.y <= frame.bottom + 1;
    });
    if (drawn.length === 0) fault('empty plot', caption && caption.textContent);
    const texts = [...svg.querySelectorAll('text')].filter(t => t.textContent.trim());
    if (texts.length < 3) fault('empty plot', 'no text on its axes');
    const raw = texts.find(t => /\[\w+_\w+\]/.test(t.textContent));
    if (raw) fault('raw unit', raw.textContent);
    const places = texts.map(t => [t, t.getBoundingClientRect()]);
    for (const [text, r] of places)
      if (r.left < box.left - 2 || r.right > box.right + 2 || r.top < box.top - 2 || r.bottom > box.bottom + 2)
        { fault('cut text', text.textContent); break; }
    // The box of a text that is turned says nothing: only those that stand upright are held against each other.
    const upright = places.filter(([t]) => Math.abs(t.getScreenCTM().b) < 1e-6);
    const over = upright.flatMap(([a, p], i) => upright.slice(i + 1).filter(([b, q]) =>
        p.right > q.left + 1 && q.right > p.left + 1 && p.bottom > q.top + 4 && q.bottom > p.top + 4)
        .map(([b]) => `${a.textContent} and ${b.textContent}`));
    if (over.length > 0) fault('overlapping text', `${over.length}: ${over[0]}: ${caption && caption.textContent}`);
    const scale = box.width / svg.viewBox.baseVal.width;
    for (const text of texts) {
      const size = parseFloat(getComputedStyle(text).fontSize) * scale;
      if (size < 9) { fault('small text', `${size} px: ${text.textContent}`); break; }
    }
  }
  const channel = c => (c /= 255, c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
  const light = color => {
    const [r, g, b] = color.match(/[\d.]+/g).map(Number);
    return 0.2126 * channel(r) + 0.7152 * channel(g) + 0.0722 * channel(b);
  };
  const paper = light(getComputedStyle(document.body).backgroundColor);
  for (const e of document.querySelectorAll('p,td,th,h1,h2,figcaption,svg text')) {
    if (!shown(e) || !e.textContent.trim()) continue;
    const drawing = e.closest('svg');
    const ink = light(getComputedStyle(e)[drawing ? 'fill' : 'color']);
    const under = drawing ? light(getComputedStyle(drawing).backgroundColor) : paper;
    const contrast = (Math.max(ink, under) + 0.05) / (Math.min(ink, under) + 0.05);
    if (contrast < 4.5) { fault('contrast', `${contrast}: ${e.textContent}`); break; }
  }
  const series = document.getElementById('time-series');
  if (series) {
    const canvases = [...series.querySelectorAll('canvas')].filter(shown);
    const hasInk = c => c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some(x => x > 0);
    if (!canvases.some(c => c.width > 50 && c.height > 50 && hasInk(c))) fault('empty plot', 'time series');
  }
  const replay = document.getElementById('replay');
  if (replay) {
    const canvas = replay.querySelector('canvas');
    const slider = replay.querySelector('input[type="range"]');
    const jump = document.querySelector('button.jump');
    if (!canvas || canvas.width < 50) fault('empty plot', 'replay');
    else {
      // The picture changes with time, and a worst moment moves both the slider and the picture.
      const before = canvas.toDataURL();
      slider.value = (Number(slider.min) + Number(slider.max)) / 2;
      slider.dispatchEvent(new Event('input'));
      if (canvas.toDataURL() === before) fault('empty plot', 'the replay shows the same at every time');
      if (!jump) fault('missing plot', 'no worst moment to jump to');
      else {
        jump.click();
        if (Math.abs(Number(slider.value) - Number(jump.dataset.flightTime)) > 0.01)
          fault('empty plot', `the replay shows ${slider.value} s instead of ${jump.dataset.flightTime} s`);
      }
    }
  }
  // What a screen reader needs: a name for every control, and one top heading.
  for (const control of document.querySelectorAll('button,select,input,[role="img"],[role="region"]')) {
    if (shown(control) && !(control.getAttribute('aria-label') || control.textContent.trim()))
      fault('no name', control.outerHTML);
  }
  if (document.querySelectorAll('h1').length !== 1) fault('no name', 'not one top heading');
  try {
    if (!JSON.parse(document.getElementById('result').textContent).schema.startsWith('swarmcert/'))
      fault('no result', 'another schema');
  } catch (error) { fault('no result', error); }
  const command = document.getElementById('command');
  if (!command || !command.textContent.startsWith('swarmcert ')) fault('no command', '');
  if (!document.querySelector('button[data-copies="command"]:not([hidden])'))
    fault('no command', 'no button to copy it');
  for (const [picture, svg] of copies) {
    svg.remove();
    picture.style.display = '';
  }
  if (window.pwned || document.title.includes('pwned')) fault('injection', document.title);
  return faults.concat(window.policyFaults || []);
})()
"""

WATCH = """window.policyFaults = [];
document.addEventListener('securitypolicyviolation', e =>
    window.policyFaults.push(['policy', e.violatedDirective + ' ' + e.blockedURI + ' ' + e.sample]));"""


def find():
    """Returns the path of a Chromium, or None."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if path := shutil.which(name):
            return path
    return None


class Browser:
    """One browser, one tab. Use as a context manager."""

    def __init__(self, path):
        self._path = path

    def __enter__(self):
        self._profile = tempfile.TemporaryDirectory(prefix="swarmcert-browser-")
        to_browser, self._write = os.pipe()
        self._read, from_browser = os.pipe()

        def place():  # the protocol's file descriptors are 3 and 4
            a, b = os.dup(to_browser), os.dup(from_browser)
            os.dup2(a, 3)
            os.dup2(b, 4)

        self._process = subprocess.Popen(
            [self._path, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--remote-debugging-pipe",
             "--disable-extensions", "--enable-unsafe-swiftshader", "--no-first-run", "--disable-background-networking",
             f"--user-data-dir={self._profile.name}", "about:blank"],
            preexec_fn=place, close_fds=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_browser)
        os.close(from_browser)
        self._buffer, self._next, self._events, self._session = b"", 0, [], None
        target = self._call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self._call(domain + ".enable")
        self._call("Page.addScriptToEvaluateOnNewDocument", source=WATCH)
        return self

    def __exit__(self, *_):
        self._process.terminate()
        self._process.wait(20)
        os.close(self._read)
        os.close(self._write)
        self._profile.cleanup()

    def _message(self):
        while b"\0" not in self._buffer:
            part = os.read(self._read, 1 << 20)
            if not part:
                raise RuntimeError("the browser ended")
            self._buffer += part
        text, self._buffer = self._buffer.split(b"\0", 1)
        return json.loads(text)

    def _call(self, method, **parameters):
        self._next += 1
        request = {"id": self._next, "method": method, "params": parameters}
        if self._session:
            request["sessionId"] = self._session
        os.write(self._write, json.dumps(request).encode() + b"\0")
        while True:
            message = self._message()
            if message.get("id") == self._next:
                if "error" in message:
                    raise RuntimeError(f"{method}: {message['error']}")
                return message["result"]
            self._events.append(message)

    def _evaluate(self, script):
        answer = self._call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(answer["exceptionDetails"])
        return answer["result"].get("value")

    def _load(self, page):
        self._events = []
        self._call("Page.navigate", url=pathlib.Path(page).resolve().as_uri())
        while not any(e.get("method") == "Page.loadEventFired" for e in self._events):
            self._events.append(self._message())
            if self._events[-1].get("method") == "Page.javascriptDialogOpening":  # the page waits for an answer
                self._call("Page.handleJavaScriptDialog", accept=True)
        # Drawings of a script appear one frame later.
        self._evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def _heard(self, page):
        """Returns faults among the events since the page was requested."""
        url = pathlib.Path(page).resolve().as_uri()
        for event in self._events:
            method, p = event.get("method"), event.get("params", {})
            if method == "Runtime.exceptionThrown":
                yield ["console", p["exceptionDetails"].get("text", "exception")]
            elif method == "Runtime.consoleAPICalled" and p["type"] in ("error", "warning", "assert"):
                yield ["console", str(p["args"])[:200]]
            elif method == "Log.entryAdded" and "GL Driver Message" in p["entry"]["text"]:
                pass  # about the speed of the software renderer, when the check reads the image
            elif method == "Log.entryAdded" and p["entry"]["level"] in ("error", "warning"):
                kind = "policy" if "Content Security Policy" in p["entry"]["text"] else "console"
                yield [kind, p["entry"]["text"][:200]]
            elif method == "Network.requestWillBeSent":
                wanted = p["request"]["url"]
                if wanted != url and not wanted.startswith("data:"):
                    yield ["network", wanted]
            elif method == "Page.javascriptDialogOpening":
                yield ["injection", p["message"]]

    def accessibility(self, page, axe):
        """Returns the findings of axe (the text of axe.min.js) on a page, as [kind, rule, what]."""
        self._load(page)
        self._evaluate(axe + ";0")
        found = self._evaluate("axe.run().then(all => all.violations.map(v => [v.id, v.nodes[0].html.slice(0, 200)]))")
        return [["accessibility", rule, what] for rule, what in found]

    def picture(self, path, width, most_px=4000):
        """Saves the top of the loaded page as PNG. Returns the number of bytes."""
        height = min(most_px, self._evaluate("document.documentElement.scrollHeight"))
        clip = {"x": 0, "y": 0, "width": width, "height": height, "scale": 1}
        shot = self._call("Page.captureScreenshot", format="png", captureBeyondViewport=True, clip=clip)
        return pathlib.Path(path).write_bytes(base64.b64decode(shot["data"]))

    def faults(self, page, widths=(390, 768, 1280), schemes=("light", "dark"), pictures=None):
        """[kind, width, what] of all that is wrong with a report: console, policy (of content), network, overflow, wide
        table, missing plot, empty plot, no caption, raw unit, cut text, overlapping text, small text, contrast, no
        name, no result, no command, injection. The page is loaded at every width, and pictured there as
        <pictures>-<width>.png; colour schemes and print are looked at on the widest."""
        found = []
        for width in widths:
            self._call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
            self._load(page)
            found += [[kind, width, what] for kind, what in self._evaluate(CHECK)]
            found += [[kind, width, what] for kind, what in self._heard(page)]
            if pictures and self.picture(f"{pictures}-{width}.png", width) < 4000:
                found.append(["no picture", width, "a screenshot of so few bytes shows nothing"])
        for scheme in schemes:
            self._call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
            found += [[kind, scheme, what] for kind, what in self._evaluate(CHECK)]
        self._call("Emulation.setEmulatedMedia", media="print", features=[])
        found += [[kind, "print", what] for kind, what in self._evaluate(CHECK) if kind in ("missing plot", "contrast")]
        self._call("Emulation.setEmulatedMedia", media="", features=[])
        self._evaluate("document.querySelector('button[data-copies]')?.click()")
        text = self._evaluate("new Promise(done => setTimeout(() => "
                              "done(document.querySelector('button[data-copies]')?.textContent), 50))")
        if text is not None and "opied" not in text:
            found.append(["no command", widths[-1], "the button does nothing: " + text])
        unique = []
        for fault in found:
            if fault not in unique:
                unique.append(fault)
        return unique
