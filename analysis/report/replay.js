// Flights in space: all vehicles with their whole trajectories, coloured by the residual force, and the force on each
// at one time as an arrow.
(function () {
  'use strict';
  var box = document.getElementById('replay');
  var data = window.flown(), flights = [];
  data.logs.forEach(function (log) {
    if (!log.columns[data.group('position').at].some(isFinite)) return;
    var last = flights[flights.length - 1];
    if (!last || last.name !== log.flight) flights.push(last = {name: log.flight, logs: []});
    last.logs.push(log);
  });
  var PLACE = data.group('position').at, BEFORE = data.group('residual').at;
  var AFTER = data.group('residual after') ? data.group('residual after').at : null;
  /// From no error to the largest: readable on both papers.
  var SCALE = ['#3b6fb6', '#35a79c', '#c9b037', '#e0702b', '#b5123b'];
  function page(name) { return getComputedStyle(document.documentElement).getPropertyValue(name).trim(); }
  function element(kind, label, parent) {
    var made = document.createElement(kind);
    if (label) made.setAttribute('aria-label', label);
    parent.appendChild(made);
    return made;
  }
  var renderer;
  try {
    renderer = new THREE.WebGLRenderer({antialias: true, preserveDrawingBuffer: true});
  } catch (error) {
    element('p', '', box).textContent = 'The replay needs WebGL, which this browser does not offer.';
    return;
  }

  // --- controls ---
  var bar = element('div', '', box);
  var which = element('select', 'flight of the replay', bar);
  function options(choice, names, changed) {
    names.forEach(function (name, i) {
      var option = element('option', '', choice);
      option.value = i;
      option.textContent = name;
    });
    choice.addEventListener('change', changed);
  }
  options(which, flights.map(function (flight) { return flight.name; }), function () { stop(); build(); });
  var coloured = element('select', 'colour of the trajectories', bar);
  options(coloured, AFTER ? ['residual before', 'residual after'] : ['residual'],
          function () { var t = now; build(); at(t); });
  var play = element('button', '', bar);
  play.type = 'button';
  play.textContent = 'Play';
  var speed = element('select', 'speed of the replay', bar);
  [0.25, 1, 4].forEach(function (factor) {
    var option = element('option', '', speed);
    option.value = factor;
    option.textContent = factor + ' x';
    option.selected = factor === 1;
  });
  var slider = element('input', 'time of the replay in seconds', box);
  slider.type = 'range';
  slider.className = 'slider';
  slider.step = 'any';
  var stage = element('div', '', box);
  stage.className = 'stage';
  stage.appendChild(renderer.domElement);
  renderer.domElement.setAttribute('role', 'img');
  renderer.domElement.setAttribute('tabindex', '0');
  var legend = element('div', '', box);
  legend.className = 'legend';

  // --- the scene; z points up ---
  THREE.Object3D.DefaultUp.set(0, 0, 1);
  var scene, camera, orbit, vehicles, metres, square, large, low, high, now, perUnit;
  function finite(log, row, first) {
    return [first, first + 1, first + 2].every(function (k) { return isFinite(log.columns[k][row]); });
  }
  function vector(log, row, first) {
    return new THREE.Vector3(log.columns[first][row], log.columns[first + 1][row], log.columns[first + 2][row]);
  }
  function arrow(color) {
    var made = new THREE.ArrowHelper(new THREE.Vector3(0, 0, 1), new THREE.Vector3(), 1, new THREE.Color(page(color)));
    scene.add(made);
    return made;
  }
  function bounds(flight) {
    var around = new THREE.Box3();
    low = Infinity;
    high = -Infinity;
    flight.logs.forEach(function (log) {
      for (var i = 0; i < log.rows; ++i) {
        if (!finite(log, i, PLACE)) continue;
        around.expandByPoint(vector(log, i, PLACE));
        low = Math.min(low, log.columns[0][i]);
        high = Math.max(high, log.columns[0][i]);
      }
    });
    return around;
  }
  /// The size of the mean force of two rows: what is thinned holds the extremes of an interval.
  function error(log, row, first) {
    var even = row - row % 2, odd = Math.min(even + 1, log.rows - 1);
    if (!finite(log, even, first) || !finite(log, odd, first)) return NaN;
    return vector(log, even, first).add(vector(log, odd, first)).length() / 2;
  }
  /// 95 % of the forces before are smaller.
  function largeForce(flight) {
    var sizes = [];
    flight.logs.forEach(function (log) {
      for (var i = 0; i < log.rows; ++i) if (isFinite(error(log, i, BEFORE))) sizes.push(error(log, i, BEFORE));
    });
    sizes.sort(function (a, b) { return a - b; });
    return sizes[Math.floor(0.95 * sizes.length)] || 0;
  }
  function colorAt(share) {
    var place = Math.min(1, Math.max(0, share)) * (SCALE.length - 1), k = Math.min(SCALE.length - 2, Math.floor(place));
    return new THREE.Color(SCALE[k]).lerp(new THREE.Color(SCALE[k + 1]), place - k);
  }
  function trajectory(log) {
    var first = coloured.value === '1' ? AFTER : BEFORE, cut = new THREE.Color(page('--line'));
    var places = [], colors = [];
    for (var i = 0; i + 1 < log.rows; ++i) {
      if (!finite(log, i, PLACE) || !finite(log, i + 1, PLACE)) continue;
      var size = error(log, i, first), color = isFinite(size) && large > 0 ? colorAt(size / large) : cut;
      [i, i + 1].forEach(function (k) {
        places.push(log.columns[PLACE][k], log.columns[PLACE + 1][k], log.columns[PLACE + 2][k]);
        colors.push(color.r, color.g, color.b);
      });
    }
    var geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(places, 3));
    geometry.setAttribute('color', new THREE.Float32BufferAttribute(colors, 3));
    return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({vertexColors: THREE.VertexColors}));
  }
  /// A length of 1, 2 or 5 times a power of ten, about a fifth of `size`.
  function roundLength(size) {
    var power = Math.pow(10, Math.floor(Math.log10(size / 5))), steps = size / 5 / power;
    return power * (steps >= 5 ? 5 : steps >= 2 ? 2 : 1);
  }
  /// A grid at the lowest point of the flight, and a bar as long as a square beside it.
  function ground(around) {
    var middle = around.getCenter(new THREE.Vector3());
    square = roundLength(metres);
    var grid = new THREE.GridHelper(10 * square, 10, new THREE.Color(page('--line')), new THREE.Color(page('--line')));
    grid.rotation.x = Math.PI / 2;
    grid.position.set(Math.round(middle.x / square) * square, Math.round(middle.y / square) * square, around.min.z);
    scene.add(grid);
    var bar = new THREE.Mesh(new THREE.BoxGeometry(square, 0.01 * metres, 0.01 * metres),
                             new THREE.MeshBasicMaterial({color: new THREE.Color(page('--ink'))}));
    var corner = Math.max(1, Math.ceil((middle.y - around.min.y) / square)) * square;
    bar.position.set(grid.position.x + square / 2, grid.position.y - corner, around.min.z);
    scene.add(bar);
  }
  function build() {
    var flight = flights[Number(which.value)];
    var around = bounds(flight), middle = around.getCenter(new THREE.Vector3());
    metres = Math.max(0.1, around.getSize(new THREE.Vector3()).length());
    large = largeForce(flight);
    perUnit = large > 0 ? 0.2 * metres / large : 0;
    scene = new THREE.Scene();
    scene.background = new THREE.Color(page('--paper'));
    ground(around);
    var colors = ['--ink', '--curve-y', '--curve-w'];
    vehicles = flight.logs.map(function (log, i) {
      var color = colors[i % colors.length];
      var body = new THREE.Mesh(new THREE.SphereGeometry(0.012 * metres, 16, 12),
                                new THREE.MeshBasicMaterial({color: new THREE.Color(page(color))}));
      scene.add(body, trajectory(log));
      return {log: log, body: body, color: color, before: arrow('--curve-x'), after: arrow('--curve-z')};
    });
    camera = new THREE.PerspectiveCamera(45, 1, 0.01 * metres, 40 * metres);
    camera.position.set(middle.x + 0.7 * metres, middle.y - 0.95 * metres, middle.z + 0.55 * metres);
    if (orbit) orbit.dispose();
    orbit = new THREE.OrbitControls(camera, renderer.domElement);
    orbit.target.copy(middle);
    orbit.enableKeys = false;
    orbit.enableZoom = false;  // the wheel scrolls the page; + and - zoom
    orbit.addEventListener('change', draw);
    orbit.update();
    slider.min = low;
    slider.max = high;
    resize();
    at(low);
  }
  /// The last row at or before `time` whose place is known, or the first.
  function rowAt(log, time) {
    var first = 0, last = log.rows, times = log.columns[0];
    while (first < last) {
      var middle = (first + last) >> 1;
      if (times[middle] <= time) first = middle + 1; else last = middle;
    }
    var row = Math.max(0, first - 1);
    while (row > 0 && !finite(log, row, PLACE)) --row;
    while (row + 1 < log.rows && !finite(log, row, PLACE)) ++row;
    return row;
  }
  function pointArrow(made, log, row, first) {
    var force = first !== null && finite(log, row, first) ? vector(log, row, first) : new THREE.Vector3();
    var length = force.length() * perUnit;
    made.visible = length > 1e-4 * metres;
    if (!made.visible) return '';
    made.position.copy(vector(log, row, PLACE));
    made.setDirection(force.clone().normalize());
    made.setLength(length, Math.min(0.3 * length, 0.04 * metres), Math.min(0.2 * length, 0.025 * metres));
    return short(force.length());
  }
  function short(x) { return String(Number(x.toPrecision(2))); }
  function say(text, color) {
    var entry = element('span', '', legend);
    if (color) entry.style.color = color;
    entry.textContent = text + '   ';
  }
  function at(time) {
    now = time;
    slider.value = time;
    legend.textContent = '';
    say('|error| 0');
    SCALE.forEach(function (color) {
      var entry = element('span', '', legend);
      entry.style.color = color;
      entry.textContent = '\u25A0';
    });
    say(' ' + short(large) + ' ' + data.unit + ' and more');
    say('bar and squares: ' + square + ' m');
    say(time.toFixed(2) + ' s:');
    if (AFTER) say('arrows: residual before', page('--curve-x')), say('and after', page('--curve-z'));
    else say('arrows: residual', page('--curve-x'));
    var words = [];
    vehicles.forEach(function (vehicle) {
      var log = vehicle.log, row = rowAt(log, time);
      vehicle.body.position.copy(vector(log, row, PLACE));
      var before = pointArrow(vehicle.before, log, row, BEFORE), after = pointArrow(vehicle.after, log, row, AFTER);
      var force = before + (AFTER ? ' \u2192 ' + (after || '0') : '') + ' ' + data.unit;
      words.push(log.vehicle + (before ? ' ' + force : ''));
      say('\u25CF ' + words[words.length - 1], page(vehicle.color));
    });
    renderer.domElement.setAttribute('aria-label',
                                     'Vehicles in space at ' + time.toFixed(2) + ' s. ' + words.join(', '));
    draw();
  }
  function draw() { renderer.render(scene, camera); }
  function resize() {
    var width = stage.clientWidth, height = Math.round(Math.min(0.75 * width, 480));
    if (width === 0) return;
    renderer.setPixelRatio(window.devicePixelRatio || 1);
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    draw();
  }

  // --- time ---
  var playing = false, last = 0;
  function frame(stamp) {
    if (!playing) return;
    var next = now + Math.min(0.1, (stamp - last) / 1000) * Number(speed.value);
    last = stamp;
    if (next >= high) stop();
    at(Math.min(next, high));
    if (playing) requestAnimationFrame(frame);
  }
  function stop() {
    playing = false;
    play.textContent = 'Play';
  }
  play.addEventListener('click', function () {
    if (playing) { stop(); return; }
    playing = true;
    play.textContent = 'Pause';
    if (now >= high) now = low;
    last = performance.now();
    requestAnimationFrame(frame);
  });
  slider.addEventListener('input', function () { stop(); at(Number(slider.value)); });
  window.addEventListener('resize', function () { resize(); });
  renderer.domElement.addEventListener('keydown', function (event) {
    var turn = {ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1]}[event.key];
    var zoom = {'+': 0.9, '-': 1 / 0.9}[event.key];
    if (!turn && !zoom) return;
    event.preventDefault();
    var from = new THREE.Spherical(), offset = camera.position.clone().sub(orbit.target);
    var up = new THREE.Quaternion().setFromUnitVectors(camera.up, new THREE.Vector3(0, 1, 0));
    from.setFromVector3(offset.applyQuaternion(up));
    if (turn) {
      from.theta += turn[0];
      from.phi = Math.min(3.1, Math.max(0.04, from.phi + turn[1]));
    }
    if (zoom) from.radius *= zoom;
    camera.position.copy(orbit.target).add(offset.setFromSpherical(from).applyQuaternion(up.inverse()));
    orbit.update();
    draw();
  });
  document.querySelectorAll('button.jump').forEach(function (button) {
    button.hidden = false;
    button.addEventListener('click', function () {
      flights.forEach(function (flight, i) {
        if (flight.name !== button.dataset.flight) return;
        stop();
        which.value = i;
        build();
        at(Math.min(high, Math.max(low, Number(button.dataset.flightTime))));
      });
    });
  });
  if (flights.length === 0) return;
  build();
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', function () { var t = now; build(); at(t); });
})();
