// Curves over time with zoom. The page's data are JSON; names in it become text, never markup.
(function () {
  'use strict';
  var box = document.getElementById('time-series');
  var all = JSON.parse(document.getElementById('time-series-data').textContent);
  var choice = document.createElement('select');
  var plot = document.createElement('div');
  plot.className = 'plot';
  box.appendChild(choice);
  box.appendChild(plot);
  all.forEach(function (series, i) {
    var option = document.createElement('option');
    option.value = i;
    option.textContent = series.name;
    choice.appendChild(option);
  });
  var graph = null;
  function show(series) {
    if (graph) graph.destroy();
    // dygraphs writes labels and annotations as markup: only numbers and words of this file may reach it.
    graph = new Dygraph(plot, series.rows, {
      labels: ['time [s]', 'x', 'y', 'z', 'z without effects'],
      colors: ['#d08a00', '#3a8f3a', '#1f4fb4', '#b0b0b0'],
      ylabel: 'force residual [gf]',
      xlabel: 'time on the log [s]',
      legend: 'always',
      showRangeSelector: true,
      connectSeparatedPoints: false
    });
    graph.setAnnotations(series.marks.map(function (mark) {
      return {series: 'z', x: Number(mark.time), shortText: String(Number(mark.rank)),
              text: 'worst moment ' + Number(mark.rank) + ': ' + Number(mark.gf).toFixed(1) + ' gf'};
    }));
  }
  choice.addEventListener('change', function () { show(all[Number(choice.value)]); });
  if (all.length > 0) show(all[0]);
})();
