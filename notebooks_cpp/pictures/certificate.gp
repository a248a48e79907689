# Lipschitz constants of the bundled network: product of norms, proved bound, witnessed slope.
reset
set terminal pngcairo size 900,300 font 'sans-serif,11' noenhanced
set output 'certificate.png'
set style data histograms
set style fill solid 0.9 noborder
set logscale y
set yrange [10:*]
set ylabel 'Lipschitz constant'
set tics nomirror out
set grid y linecolor rgb '#cccccc'
set key outside right
set boxwidth 0.9
plot 'certificate/bounds.dat' using 2:xtic(1) title 'product of norms' linecolor rgb '#999999', \
  '' using 3 title 'proved upper bound' linecolor rgb '#0072b2', \
  '' using 4 title 'witnessed lower bound' linecolor rgb '#e69f00'
