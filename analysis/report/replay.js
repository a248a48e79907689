// Flights in space: vehicles with trails, and the residual force on each as arrows before and after effects were added.
(function () {
  'use strict';
  var box = document.getElementById('replay');
  var data = JSON.parse(document.getElementById('replay-data').textContent);
  // Columns of a row: time, position (3), force before (3), force after (3).
  var PLACE = 1, BEFORE = 4, AFTER = 7;
  var TRAIL_S = 4;
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
  data.flights.forEach(function (flight, i) {
    var option = element('option', '', which);
    option.value = i;
    option.textContent = flight.name;
  });
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
  var scene, camera, orbit, vehicles, metres, low, high, now, perUnit;
  function finite(row, first) { return row[first] !== null && row[first + 1] !== null && row[first + 2] !== null; }
  function vector(row, first) { return new THREE.Vector3(row[first], row[first + 1], row[first + 2]); }
  function arrow(color) {
    var made = new THREE.ArrowHelper(new THREE.Vector3(0, 0, 1), new THREE.Vector3(), 1, new THREE.Color(page(color)));
    scene.add(made);
    return made;
  }
  function bounds(flight) {
    var around = new THREE.Box3();
    low = Infinity;
    high = -Infinity;
    flight.vehicles.forEach(function (vehicle) {
      vehicle.rows.forEach(function (row) {
        around.expandByPoint(vector(row, PLACE));
        low = Math.min(low, row[0]);
        high = Math.max(high, row[0]);
      });
    });
    return around;
  }
  /// 95 % of the forces before are drawn shorter than a quarter of the room.
  function scale(flight) {
    var sizes = [];
    flight.vehicles.forEach(function (vehicle) {
      vehicle.rows.forEach(function (row) { if (finite(row, BEFORE)) sizes.push(vector(row, BEFORE).length()); });
    });
    sizes.sort(function (a, b) { return a - b; });
    var size = sizes[Math.floor(0.95 * sizes.length)];
    return size > 0 ? 0.25 * metres / size : 0;
  }
  function build() {
    var flight = data.flights[Number(which.value)];
    var around = bounds(flight), middle = around.getCenter(new THREE.Vector3());
    metres = Math.max(0.5, around.getSize(new THREE.Vector3()).length());
    perUnit = scale(flight);
    scene = new THREE.Scene();
    scene.background = new THREE.Color(page('--paper'));
    var grid = new THREE.GridHelper(2 * metres, 20, new THREE.Color(page('--soft')), new THREE.Color(page('--line')));
    grid.rotation.x = Math.PI / 2;
    grid.position.set(middle.x, middle.y, Math.min(0, around.min.z));
    scene.add(grid);
    var colors = ['--curve-w', '--ink', '--soft'];
    vehicles = flight.vehicles.map(function (vehicle, i) {
      var color = new THREE.Color(page(colors[i % colors.length]));
      var body = new THREE.Mesh(new THREE.SphereGeometry(0.012 * metres, 16, 12), new THREE.MeshBasicMaterial({color: color}));
      var trail = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({color: color}));
      trail.frustumCulled = false;
      scene.add(body, trail);
      return {name: vehicle.name, rows: vehicle.rows, body: body, trail: trail,
              before: arrow('--curve-x'), after: arrow('--curve-z')};
    });
    camera = new THREE.PerspectiveCamera(45, 1, 0.01 * metres, 20 * metres);
    camera.position.set(middle.x + 0.55 * metres, middle.y - 0.7 * metres, middle.z + 0.4 * metres);
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
  /// The last row at or before `time`, or -1.
  function rowAt(rows, time) {
    var first = 0, last = rows.length;
    while (first < last) {
      var middle = (first + last) >> 1;
      if (rows[middle][0] <= time) first = middle + 1; else last = middle;
    }
    return first - 1;
  }
  function pointArrow(made, row, first) {
    var force = finite(row, first) ? vector(row, first) : new THREE.Vector3();
    var length = force.length() * perUnit;
    made.visible = length > 1e-4 * metres;
    if (!made.visible) return '';
    made.position.copy(vector(row, PLACE));
    made.setDirection(force.clone().normalize());
    made.setLength(length, Math.min(0.3 * length, 0.04 * metres), Math.min(0.2 * length, 0.025 * metres));
    return String(Number(force.length().toPrecision(2)));
  }
  function at(time) {
    now = time;
    slider.value = time;
    legend.textContent = '';
    function say(text, color) {
      var entry = element('span', '', legend);
      if (color) entry.style.color = page(color);
      entry.textContent = text + '   ';
    }
    say(time.toFixed(2) + ' s');
    say('\u25A0 residual before', '--curve-x');
    say('\u25A0 after', '--curve-z');
    var words = [];
    vehicles.forEach(function (vehicle) {
      var index = rowAt(vehicle.rows, time), row = vehicle.rows[Math.max(0, index)];
      vehicle.body.position.copy(vector(row, PLACE));
      var before = pointArrow(vehicle.before, row, BEFORE), after = pointArrow(vehicle.after, row, AFTER);
      if (before) words.push(vehicle.name + ' ' + before + ' \u2192 ' + (after || '0') + ' ' + data.unit);
      var start = rowAt(vehicle.rows, time - TRAIL_S) + 1;
      vehicle.trail.geometry.setFromPoints(vehicle.rows.slice(start, Math.max(index, 0) + 1).map(function (r) { return vector(r, PLACE); }));
    });
    say(words.join(', '));
    renderer.domElement.setAttribute('aria-label', 'Vehicles in space at ' + time.toFixed(2) + ' s. ' + words.join(', '));
    draw();
  }
  function draw() { renderer.render(scene, camera); }
  function resize() {
    var width = stage.clientWidth, height = Math.round(Math.min(0.6 * width, 480));
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
  which.addEventListener('change', function () { stop(); build(); });
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
    button.addEventListener('click', function () {
      data.flights.forEach(function (flight, i) {
        if (flight.name !== button.dataset.flight) return;
        stop();
        which.value = i;
        build();
        at(Math.min(high, Math.max(low, Number(button.dataset.flightTime))));
      });
    });
  });
  build();
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', function () { var t = now; build(); at(t); });
})();
