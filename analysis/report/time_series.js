// Curves over time with zoom. The data of the page are JSON; names in it become text, never markup.
(function () {
  'use strict';
  var box = document.getElementById('time-series');
  var data = JSON.parse(document.getElementById('time-series-data').textContent);
  var all = data.series, unit = String(data.unit);
  // Colours of the page by name, because dygraphs draws on a canvas, which does not resolve CSS variables.
  function page(name) { return getComputedStyle(document.documentElement).getPropertyValue(name).trim(); }
  // Columns of a row: time, x, y, z, z without effects, z of the model before.
  function minus(a, b) { return a !== null && b !== null ? a - b : null; }
  var views = [
    {title: 'vertical force: model over measurement', labels: ['measured', 'model', 'residual'],
     colors: ['--curve-w', '--curve-z', '--curve-x'], ylabel: 'vertical force beyond thrust [' + unit + ']',
     row: function (r) { return [r[0], r[4], minus(r[4], r[3]), r[3]]; }, marked: 'residual'},
    {title: 'force residual: x, y, z', labels: ['x', 'y', 'z'], colors: ['--curve-x', '--curve-y', '--curve-z'],
     ylabel: 'force residual [' + unit + ']', row: function (r) { return [r[0], r[1], r[2], r[3]]; }, marked: 'z'}
  ];
  if (data.has_before) {
    views.unshift(
        {title: 'vertical force: models before and after over measurement',
         labels: ['measured', 'model before', 'model after'], colors: ['--curve-w', '--curve-x', '--curve-z'],
         ylabel: 'vertical force beyond thrust [' + unit + ']',
         row: function (r) { return [r[0], r[4], minus(r[4], r[5]), minus(r[4], r[3])]; }, marked: 'model after'});
  }
  function selection(label, names) {
    var choice = document.createElement('select');
    choice.setAttribute('aria-label', label);
    names.forEach(function (name, i) {
      var option = document.createElement('option');
      option.value = i;
      option.textContent = name;
      choice.appendChild(option);
    });
    choice.addEventListener('change', show);
    box.appendChild(choice);
    return choice;
  }
  var which = selection('log', all.map(function (series) { return series.name; }));
  var how = selection('view', views.map(function (view) { return view.title; }));
  var legend = document.createElement('div');
  legend.className = 'legend';
  box.appendChild(legend);
  var plot = document.createElement('div');
  plot.className = 'plot';
  box.appendChild(plot);
  // The legend of dygraphs needs style attributes, which the content security policy forbids; this page has its own.
  Dygraph.PLUGINS = Dygraph.PLUGINS.filter(function (plugin) { return plugin !== Dygraph.Plugins.Legend; });
  var graph = null;
  // Labels and the legend of dygraphs are markup, so only numbers and words of this file may reach them.
  function tell(view, time, values) {
    legend.textContent = '';
    view.labels.forEach(function (label, i) {
      var entry = document.createElement('span');
      entry.style.color = page(view.colors[i]);
      entry.textContent = '\u25A0 ' + label +
          (values && values[i] !== null ? ' ' + values[i].toFixed(2) + ' ' + unit : '') + '   ';
      legend.appendChild(entry);
    });
    if (values) legend.appendChild(document.createTextNode('at ' + time.toFixed(2) + ' s'));
  }
  function show() {
    if (graph) graph.destroy();
    var series = all[Number(which.value)];
    var view = views[Number(how.value)];
    var rows = series.rows.map(view.row);
    graph = new Dygraph(plot, rows, {
      labels: ['time'].concat(view.labels),
      colors: view.colors.map(page),
      ylabel: view.ylabel,
      xlabel: 'time on the log [s]',
      axisLineColor: page('--ink'),
      gridLineColor: page('--line'),
      rangeSelectorPlotStrokeColor: page('--curve-w'),
      rangeSelectorPlotFillColor: page('--line'),
      showRangeSelector: true,
      connectSeparatedPoints: false,
      highlightCallback: function (event, x, points, row) { tell(view, x, rows[row].slice(1)); },
      unhighlightCallback: function () { tell(view); }
    });
    tell(view);
    // The handles of the range selector work only with the mouse; selections and buttons do the same by keyboard.
    plot.querySelectorAll('img').forEach(function (handle) { handle.alt = ''; });
    graph.setAnnotations(series.marks.map(function (mark) {
      return {series: view.marked, x: Number(mark.time), shortText: String(Number(mark.rank)),
              text: 'worst moment ' + Number(mark.rank) + ': ' + Number(mark.size).toPrecision(3) + ' ' + unit};
    }));
  }
  if (all.length > 0) show();
  document.querySelectorAll('button.jump').forEach(function (button) {
    button.addEventListener('click', function () {
      all.forEach(function (series, i) {
        if (series.name !== button.dataset.series) return;
        which.value = i;
        show();
        var time = Number(button.dataset.time);
        graph.updateOptions({dateWindow: [time - 2, time + 2]});
      });
      box.scrollIntoView({block: 'center'});
    });
  });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', function () { if (graph) show(); });
})();
