# The mean vertical residual over the place of the neighbour, before and after, on one colour scale.
set terminal pngcairo size 900,420 font 'sans-serif,11' noenhanced
set output 'residual_maps.png'
stats 'before/neighbours.dat' using 3 nooutput
m = abs(STATS_min) > abs(STATS_max) ? abs(STATS_min) : abs(STATS_max)
set palette defined (-2 '#003f63', -1 '#0072b2', 0 '#f4f4f4', 1 '#d55e00', 2 '#763400')
set cbrange [-m:m]
set xrange [0:0.6]
set yrange [-1:1]
set tics nomirror out
set xlabel 'lateral distance of the neighbour [m]'
set multiplot layout 1,2
unset colorbox
set lmargin at screen 0.09
set rmargin at screen 0.44
set ylabel 'height of the neighbour above [m]'
set title 'before: the nominal model'
plot 'before/neighbours.dat' using 1:2:3 with image notitle
set colorbox
set cblabel 'mean vertical residual [mN]'
set lmargin at screen 0.50
set rmargin at screen 0.86
unset ylabel
set title 'after: + downwash, motor lag, drag'
plot 'after/neighbours.dat' using 1:2:3 with image notitle
unset multiplot
