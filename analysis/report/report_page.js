// Buttons that copy an element's text. If there is no clipboard (some browsers give files none), it falls back to the
// old API.
(function () {
  'use strict';
  function copy(text) {
    var area = document.createElement('textarea');
    area.value = text;
    document.body.appendChild(area);
    area.select();
    var done = document.execCommand('copy');
    document.body.removeChild(area);
    return done;
  }
  document.querySelectorAll('button[data-copies]').forEach(function (button) {
    button.hidden = false;
    button.addEventListener('click', function () {
      var text = document.getElementById(button.dataset.copies).textContent;
      function say(done) { button.textContent = done ? 'Copied' : 'Not copied: select and copy by hand'; }
      if (!navigator.clipboard) { say(copy(text)); return; }
      navigator.clipboard.writeText(text).then(function () { say(true); }, function () { say(copy(text)); });
    });
  });
})();
// Signals of flights, for the scripts that draw them. window.flown() returns
//   unit, axis, marks, groups [{name, unit, columns, at}], group(name),
//   logs [{flight, vehicle, rows, columns, changes}]: column 0 is the time, those of a group begin at `at`.
window.flown = (function () {
  'use strict';
  var decoded = null;
  function bytes(text) { return Uint8Array.from(atob(text), function (c) { return c.charCodeAt(0); }).buffer; }
  function values(column, rows) {
    if (typeof column === 'string') return new Float32Array(bytes(column));
    var all = new Float32Array(rows).fill(NaN);
    if (column === null) return all;
    if (typeof column === 'number') return all.fill(column);
    var UNKNOWN = -32768, steps = new Int16Array(bytes(column.data));
    return all.map(function (x, i) {
      return steps[i] === UNKNOWN ? NaN : column.low + (steps[i] + 32767) * (column.high - column.low) / 65534;
    });
  }
  return function () {
    if (decoded) return decoded;
    decoded = JSON.parse(document.getElementById('flown-data').textContent);
    var at = 1;
    decoded.groups.forEach(function (group) {
      group.at = at;
      at += group.columns.length;
    });
    decoded.group = function (name) { return decoded.groups.find(function (group) { return group.name === name; }); };
    decoded.logs.forEach(function (log) {
      log.changes = log.columns.map(function (column) { return column !== null && typeof column !== 'number'; });
      log.columns = log.columns.map(function (column) { return values(column, log.rows); });
    });
    return decoded;
  };
})();
