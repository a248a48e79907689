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
