// Signals over time, panel by panel with one cursor and one zoom, and the residual against any of them. Labels and
// legends of dygraphs are markup, so only words of the tool may reach them; names of users become text.
(function () {
  'use strict';
  var box = document.getElementById('time-series');
  var data = window.flown(), unit = data.unit;
  var before = data.group('residual'), after = data.group('residual after');
  var models = [before, after].filter(Boolean), words = after ? ['before', 'after'] : ['residual'];
  var graphs = [], shown = null, linking = false;
  // Colours of the page by name, because dygraphs draws on a canvas, which does not resolve CSS variables.
  function page(name) { return getComputedStyle(document.documentElement).getPropertyValue(name).trim(); }
  var CURVES = ['--curve-x', '--curve-y', '--curve-z', '--curve-w'], MODELS = ['--curve-x', '--curve-z'];
  function element(kind, name, parent) {
    var made = document.createElement(kind);
    made.className = name;
    parent.appendChild(made);
    return made;
  }
  function selection(label, names, first, parent, changed) {
    var choice = element('select', '', element('label', 'choice', parent));
    choice.parentNode.insertBefore(document.createTextNode(label + ' '), choice);
    names.forEach(function (name, i) {
      var option = element('option', '', choice);
      option.value = i;
      option.textContent = name;
    });
    choice.value = first;
    choice.addEventListener('change', changed);
    return choice;
  }
  /// The log with the worst moment.
  function worst() {
    var mark = data.marks.length > 0 ? data.marks[0] : {};
    return Math.max(0, data.logs.findIndex(function (log) {
      return log.flight === mark.flight && log.vehicle === mark.vehicle;
    }));
  }
  var bar = element('div', '', box);
  var names = data.logs.map(function (log) { return log.flight + ' ' + log.vehicle; });
  var which = selection('Log', names, worst(), bar, show);
  var along = selection('Residual along', ['x', 'y', 'z', 'all axes (size)'], data.axis, bar, function () {
    show();
    scatter();
  });
  var panels = element('div', '', box);

  /// The residual of a group along the chosen axis, or its size: a function of the row.
  function residual(log, group) {
    var axis = Number(along.value), c = [0, 1, 2].map(function (k) { return log.columns[group.at + k]; });
    if (axis < 3) return function (i) { return c[axis][i]; };
    return function (i) { return Math.hypot(c[0][i], c[1][i], c[2][i]); };
  }
  function column(log, at) {
    return function (i) { return log.columns[at][i]; };
  }
  /// The panels of a log: those of its signals that change.
  function panels_of(log) {
    var axis = Number(along.value);
    var list = [{
      title: axis < 3 ? 'force residual along ' + 'xyz'.charAt(axis) : 'size of the force residual',
      unit: unit, labels: words, colors: MODELS, marked: words[0],
      of: models.map(function (group) { return residual(log, group); })
    }];
    data.groups.forEach(function (group) {
      if (/^residual|^set point/.test(group.name)) return;
      var wanted = data.group('set point ' + group.name);
      var panel = {title: group.name, unit: group.unit, labels: [], colors: [], of: [], dashed: []};
      group.columns.forEach(function (name, k) {
        if (!log.changes[group.at + k]) return;
        panel.labels.push(name);
        panel.colors.push(CURVES[k % CURVES.length]);
        if (k >= CURVES.length) panel.dashed.push(name);
        panel.of.push(column(log, group.at + k));
        if (!wanted || !log.changes[wanted.at + k]) return;
        panel.labels.push('set point ' + name);
        panel.dashed.push('set point ' + name);
        panel.colors.push(CURVES[k]);
        panel.of.push(column(log, wanted.at + k));
      });
      if (panel.of.length > 0) list.push(panel);
    });
    return list;
  }
  function number(x) { return String(Number(x.toPrecision(3))); }
  function tell(panel, row) {
    panel.legend.textContent = panel.title + ' [' + panel.unit + ']   ';
    panel.labels.forEach(function (label, i) {
      var entry = element('span', '', panel.legend), value = row === undefined ? NaN : panel.of[i](row);
      entry.style.color = page(panel.colors[i]);
      entry.textContent = (panel.dashed && panel.dashed.indexOf(label) >= 0 ? '\u2504 ' : '\u25A0 ') + label +
          (isFinite(value) ? ' ' + number(value) : '') + '   ';
    });
    if (row === undefined) return;
    panel.legend.appendChild(document.createTextNode('at ' + shown.columns[0][row].toFixed(2) + ' s'));
  }
  // The legend of dygraphs needs style attributes, which the content security policy forbids; this page has its own.
  Dygraph.PLUGINS = Dygraph.PLUGINS.filter(function (plugin) { return plugin !== Dygraph.Plugins.Legend; });
  function options(panel) {
    return {
      colors: panel.colors.map(page), axisLineColor: page('--ink'), gridLineColor: page('--line'),
      axes: {y: {axisLabelWidth: 56}}
    };
  }
  function linked(action) {
    if (linking) return;
    linking = true;
    graphs.forEach(action);
    linking = false;
  }
  function draw(log, panel, is_last) {
    panel.legend = element('div', 'legend', panels);
    var plot = element('div', is_last ? 'plot last' : 'plot', panels), settings = options(panel), rows = [];
    for (var i = 0; i < log.rows; ++i) {
      rows.push([log.columns[0][i]].concat(panel.of.map(function (of) { return isFinite(of(i)) ? of(i) : null; })));
    }
    settings.labels = ['time'].concat(panel.labels);
    settings.series = {};
    (panel.dashed || []).forEach(function (label) { settings.series[label] = {strokePattern: [5, 4]}; });
    settings.axes.x = {drawAxis: is_last};
    if (is_last) {
      settings.xlabel = 'time of the flight [s]';
      settings.showRangeSelector = true;
      settings.rangeSelectorHeight = 28;
      settings.rangeSelectorPlotStrokeColor = page('--curve-w');
      settings.rangeSelectorPlotFillColor = page('--line');
    }
    settings.highlightCallback = function (event, x, points, row) {
      linked(function (other) {
        if (other.graph !== graph) other.graph.setSelection(row);
        tell(other.panel, row);
      });
    };
    settings.unhighlightCallback = function () {
      linked(function (other) {
        if (other.graph !== graph) other.graph.clearSelection();
        tell(other.panel);
      });
    };
    settings.drawCallback = function (drawn, is_initial) {
      if (is_initial) return;
      linked(function (other) {
        if (other.graph !== drawn) other.graph.updateOptions({dateWindow: drawn.xAxisRange()});
      });
    };
    var graph = new Dygraph(plot, rows, settings);
    // The handles of the range selector work only with the mouse; selections and buttons do the same by keyboard.
    plot.querySelectorAll('img').forEach(function (handle) { handle.alt = ''; });
    tell(panel);
    graphs.push({graph: graph, panel: panel});
    if (panel.marked) graph.setAnnotations(marks(log, panel.marked));
  }
  function nearest(log, time) {
    var best = 0;
    for (var i = 1; i < log.rows; ++i)
      if (Math.abs(log.columns[0][i] - time) < Math.abs(log.columns[0][best] - time)) best = i;
    return log.columns[0][best];
  }
  function marks(log, series) {
    return data.marks.filter(function (mark) {
      return mark.flight === log.flight && mark.vehicle === log.vehicle;
    }).map(function (mark) {
      return {series: series, x: nearest(log, mark.time), shortText: String(Number(mark.rank)),
              text: 'worst moment ' + Number(mark.rank) + ': ' + number(Number(mark.size)) + ' ' + unit};
    });
  }
  function show() {
    graphs.forEach(function (each) { each.graph.destroy(); });
    graphs = [];
    panels.textContent = '';
    shown = data.logs[Number(which.value)];
    var list = panels_of(shown);
    list.forEach(function (panel, k) { draw(shown, panel, k + 1 === list.length); });
  }

  // --- the residual against any signal, over all logs of the page ---
  var against_bar = element('div', '', box), variables = [];
  data.groups.forEach(function (group) {
    if (/^residual/.test(group.name)) return;
    group.columns.forEach(function (name, k) {
      if (!data.logs.some(function (log) { return log.changes[group.at + k]; })) return;
      variables.push({name: group.columns.length > 1 ? group.name + ' ' + name : name, unit: group.unit,
                      of: function (log, i) { return log.columns[group.at + k][i]; }});
    });
  });
  var velocity = data.group('velocity');
  variables.push({name: 'speed', unit: 'm/s', of: function (log, i) {
    return Math.hypot(log.columns[velocity.at][i], log.columns[velocity.at + 1][i], log.columns[velocity.at + 2][i]);
  }});
  variables.push({name: 'time', unit: 's', of: function (log, i) { return log.columns[0][i]; }});
  var against = selection('Residual against', variables.map(function (v) { return v.name; }), 2, against_bar, scatter);
  var cloud = {title: '', legend: element('div', 'legend', box), plot: element('div', 'plot cloud', box), graph: null};
  /// The means of two rows each: what is thinned holds the extremes of an interval.
  function pairs(log, of) {
    var means = [];
    for (var i = 0; i + 1 < log.rows; i += 2) means.push((of(i) + of(i + 1)) / 2);
    return means;
  }
  function scatter() {
    var variable = variables[Number(against.value)], points = [];
    data.logs.forEach(function (log) {
      var x = pairs(log, function (i) { return variable.of(log, i); });
      var y = models.map(function (group) { return pairs(log, residual(log, group)); });
      x.forEach(function (at, i) {
        var row = [at].concat(y.map(function (values) { return values[i]; }));
        if (row.every(isFinite)) points.push(row);
      });
    });
    points.sort(function (a, b) { return a[0] - b[0]; });
    var nothing = words.map(function () { return null; });
    var BINS = 24, FEWEST = 20, count = points.length, rows = [];
    var low = count ? points[Math.floor(0.005 * count)][0] : 0;
    var high = count ? points[Math.floor(0.995 * (count - 1))][0] : 1;
    for (var b = 0; b < BINS && high > low; ++b) {
      var from = low + (high - low) * b / BINS, to = low + (high - low) * (b + 1) / BINS;
      var inside = points.filter(function (p) { return p[0] >= from && p[0] <= to; });
      if (inside.length < FEWEST) continue;
      var mean = function (k) { return inside.reduce(function (sum, p) { return sum + p[k]; }, 0) / inside.length; };
      rows.push([mean(0)].concat(nothing, words.map(function (w, k) { return mean(k + 1); })));
    }
    var step = Math.ceil(count / 4000);
    points.forEach(function (p, i) { if (i % step === 0) rows.push(p.concat(nothing)); });
    rows.sort(function (a, b) { return a[0] - b[0]; });
    var settings = options({colors: MODELS.slice(0, words.length).concat(MODELS.slice(0, words.length))});
    settings.labels = ['at'].concat(words, words.map(function (w) { return 'mean ' + w; }));
    settings.series = {};
    words.forEach(function (w) {
      settings.series[w] = {strokeWidth: 0, drawPoints: true, pointSize: 1};
      settings.series['mean ' + w] = {strokeWidth: 3, drawPoints: true, pointSize: 4};
    });
    settings.connectSeparatedPoints = true;
    settings.xlabel = variable.name + ' [' + variable.unit + ']';
    settings.xValueFormatter = settings.valueFormatter = number;
    if (cloud.graph) cloud.graph.destroy();
    cloud.graph = rows.length > 1 ? new Dygraph(cloud.plot, rows, settings) : null;
    cloud.legend.textContent = 'residual [' + unit + '] of all logs of this page, and its mean   ';
    words.forEach(function (w, k) {
      var entry = element('span', '', cloud.legend);
      entry.style.color = page(MODELS[k]);
      entry.textContent = '\u25A0 ' + w + '   ';
    });
  }
  show();
  scatter();
  document.querySelectorAll('button.jump').forEach(function (button) {
    button.hidden = false;
    button.addEventListener('click', function () {
      data.logs.forEach(function (log, i) {
        if (log.flight !== button.dataset.flight || log.vehicle !== button.dataset.vehicle) return;
        which.value = i;
        show();
        var time = Number(button.dataset.flightTime);
        graphs[0].graph.updateOptions({dateWindow: [time - 2, time + 2]});
      });
      box.scrollIntoView({block: 'start'});
    });
  });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', function () { show(); scatter(); });
})();
