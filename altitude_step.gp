set xlabel 'time (s)'
set ylabel 'altitude x3 (m)'
set grid
set key bottom
set style fill transparent solid 0.35
plot 'altitude_step.dat' index 2 using 1:2:3 with filledcurves linecolor rgb '#d55e00' title 'D = 0.8', '' index 1 using 1:2:3 with filledcurves linecolor rgb '#009e73' title 'D = 0.4', '' index 0 using 1:2:3 with filledcurves linecolor rgb '#0072b2' title 'D = 0.1', 1.4 with lines linecolor rgb '#000000' title 'limit', (x > 1 ? 0.9 : NaN) with lines linecolor rgb '#000000' notitle
