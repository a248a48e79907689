set logscale x
set grid
set xlabel 'proved Lipschitz bound of the set (gf per m, m/s)'
set ylabel 'test RMSE (gf)'
set offsets graph 0.1, graph 0.1, graph 0.1, graph 0.1
plot 'trade.dat' using 3:2 with linespoints pointtype 7 linecolor rgb '#0072b2' notitle, '' using 3:2:1 with labels offset 0,1 notitle
