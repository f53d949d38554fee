# Tasks of the first day, as typed in an empty folder with asperity on the PATH.
# A test runs each task on its own, in at most two minutes: tests/cli/test_twelve_tasks.py.
SURFACE=sinusoid:amplitude=0.2mm,period=2mm

# 1. My own surface: a text file of heights in metres, one point every 5 µm
awk 'BEGIN { for (i = 0; i < 64; i++) { for (j = 0; j < 64; j++)
    printf "%.4g ", 4e-6 * sin(0.19635 * j) * cos(0.09817 * i); print "" } }' > land.txt
asperity compare land.txt --unit m --pitch 5um --magnify 20 --device touch --laws WCD

# 2. My own device: fill in what is known, and name the stiffest wall
asperity devices --template > my-arm.toml
asperity compare $SURFACE --device my-arm.toml --set max_stiffness=1500N/m

# 3. My own law: a Python file, here that of the repository
asperity compare $SURFACE --plugin "$EXAMPLES/own_law.py" --laws CS

# 4. At my stiffness: is 500 N/m safe on this device?
asperity compare $SURFACE --device touch --stiffness 500N/m

# 5. For a paper: a page with figures, and all numbers as data
asperity compare $SURFACE --device touch --html report.html --json result.json

# 6. In CHAI3D: one header, and the effect that includes it
asperity export $SURFACE --law C --device omega.3 -o texture.h
cp "$EXAMPLES/export/chai3d_effect.hpp" .

# 7. In a notebook: the last line of a cell
python -c '
import asperity as asp
result = asp.compare("sinusoid:amplitude=0.2mm,period=2mm", "touch")
print(float(result["C"].q), len(result._repr_html_()))
'

# 8. On a phone: the report is one file that needs no network
asperity compare $SURFACE --device touch --laws WCH --html phone.html

# 9. Printed: the same file has a style for paper
asperity analyze $SURFACE --law C --device touch --html print.html

# 10. In a lecture: a figure, a claim of the paper with its evidence, then the lab, stopped with Ctrl-C
asperity reproduce --claim fig-3 --figures lecture
asperity reproduce --claim eq-5 --html claim.html
timeout --preserve-status -s INT 20 asperity lab $SURFACE --law C --no-browser

# 11. After a wrong option: the message offers the right one
! asperity compare $SURFACE --devise touch
asperity compare $SURFACE --device touch

# 12. After a fault: what was recorded until the process was killed
asperity run $SURFACE --device touch --law C --duration 60s --record run.mcap & RUN=$!
until [ -s run.mcap ]; do sleep 1; done
sleep 3
kill -KILL $RUN
wait $RUN || true
asperity recording info run.mcap
asperity recording export run.mcap -o run.csv

# 13. A study: planned, simulated, run and reported, without mixing
asperity study init comparison rough.toml
sed -i.bak 's/"A", "C", "D", "H"/"C", "H"/; s/repeats = 4/repeats = 1/; s/"3 s"/"0.1 s"/' rough.toml
asperity study plan rough.toml --effect 1.5 --simulations 5
asperity study run rough.toml --participant S01 --simulate typical
asperity study report rough-simulated-typical
while printf ' 1' 2> /dev/null; do sleep 1; done |
    python -c 'import pty, sys; pty.spawn(sys.argv[1:])' \
        asperity study run rough.toml --participant P01 --terminal
! asperity study run rough.toml --participant S02 --simulate typical -o rough-simulated-device
asperity study report rough-simulated-device
asperity study remove rough-simulated-device P01

# 14. From a game asset: a normal map, whose name tells where green points, as a texture that is felt
asperity maps $SURFACE --normals gltf -o plate_nor_gl.png --extent "4mm; 4mm"
asperity compare plate_nor_gl.png --device touch --laws WC

# 15. For a paper: a table and a paragraph for its methods section, in a document that compiles
asperity compare $SURFACE --device touch --laws WCA --latex table.tex
printf '%s\n' '\documentclass{article}' '\begin{document}' '\input{table}' '\end{document}' > paper.tex
if command -v pdflatex > /dev/null; then
    pdflatex -interaction=nonstopmode -halt-on-error paper.tex
else
    echo 'not run: no pdflatex here'
fi
