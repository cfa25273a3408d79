#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The page that rbfreport writes: its numbers against rbfquery's and against the measurements; then in headless
Chromium, if there is one: it loads without errors and without network, the sliders change the picture, and what it
shows is what rbfquery answers."""
import base64
import html
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile

import numpy as np

BIN = os.path.join(os.environ["BUILD_DIR"], "bin")
failures = []


def check(condition, text):
    if not condition:
        failures.append(text)
        print("FAILED:", text)


def run(*command, stdin=None):
    done = subprocess.run(command, input=stdin, capture_output=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)}: exit {done.returncode}: {done.stderr.decode()[:500]}")
    return done.stdout


def direction(theta, phi):
    t, p = np.radians(theta), np.radians(phi)
    return np.stack(np.broadcast_arrays(np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)), -1)


def query(rbf, incident, outgoing):
    pairs = np.concatenate(np.broadcast_arrays(incident, outgoing), -1).astype("f4")
    return np.frombuffer(run(f"{BIN}/rbfquery", "-ff", rbf, stdin=pairs.tobytes()), "f4")


def measure(folder, incidences, transmit):
    """Samples of a Gaussian about the mirror direction, turned by 20 degrees of azimuth, over a diffuse floor, with noise."""
    files = []
    rng = np.random.default_rng(1)
    theta, phi = np.meshgrid(np.arange(0, 88, 4.0), np.arange(0, 360, 8.0))
    theta, phi = theta.ravel(), phi.ravel()
    outgoing = direction(theta, phi)
    for n, (t, p) in enumerate(incidences):
        f = .1 / math.pi + .6 * np.exp(30 * (outgoing @ direction(t, p + 200) - 1)) * rng.normal(1, .02, len(theta))
        name = f"{folder}/{'t' if transmit else 'r'}{n}.txt"
        with open(name, "w") as out:
            # azimuth 0 is +X: #upphi 90 says where up, +Y, is
            out.write(f"#sample_name \"<b>R&D\"\n#format: theta phi BSDF\n#intheta {t}\n#inphi {p}\n#upphi 90\n")
            for row in zip(180 - theta if transmit else theta, phi, f):
                out.write("%.3f %.3f %.6f\n" % row)
        files.append(name)
    return files


def report_of(page):
    return json.loads(re.search(r"<script>const report = (.*?);</script>", page, re.S).group(1))


def values(text):
    codes = np.frombuffer(base64.b64decode(text), "<u2").astype(float)
    return np.where(codes > 0, 1e-6 * 1e12 ** ((codes - 1) / 65534), 0)


def disc(size):
    """Directions of the pixels within the disc, as the report's legend describes them."""
    column, row = np.meshgrid(np.arange(size), np.arange(size))
    x, y = 2 * column + 1 - size, size - 1 - 2 * row
    inside = x * x + y * y < size * size
    return direction(np.hypot(x, y)[inside] / size * 90, np.degrees(np.arctan2(y, x))[inside])


def close(name, a, b, relative=3e-4):
    worst = np.max(np.abs(np.asarray(a) - b) / np.maximum(np.abs(b), 2e-6))
    check(worst <= relative, f"{name}: differs by {worst:.2g}")


def outward(component, d, outgoing):
    """From the component's own sides to the axes of rbfquery; the components tested here are front ones."""
    return d * [1, 1, -1] if outgoing and component["name"] == "tf" else d


def test_numbers(rbf, page, files):
    report = report_of(page)
    check(report["name"] == "<b>R&D", f"the sample's name is {report['name']!r}")
    check("<b>R&D" not in page, "the sample's name could act as markup")
    check([c["name"] for c in report["components"]] == ["rf", "tf"], "not the components rf and tf")
    for component in report["components"]:
        name, moving = component["name"], component["moving"]
        grid = outward(component, disc(moving["size"]), True)
        for n in range(0, len(moving["at"]), 47):
            theta = n % moving["thetas"] * moving["thetaStep"]
            phi = moving["phiFirst"] + n // moving["thetas"] * moving["phiStep"]
            incident = direction(theta, phi)
            dhr, peak, peak_theta, peak_phi, picture = moving["at"][n]
            close(f"{name} moving {n}", values(picture), query(rbf, incident, grid))
            at = outward(component, direction(peak_theta, peak_phi), True)
            close(f"{name} moving {n}, peak", [peak], query(rbf, incident, at), 2e-3)  # its direction is rounded
            check(peak * abs(at[2]) > .998 * np.max(values(picture) * abs(grid[:, 2])), f"{name} moving {n}: a pixel above the peak")
            both = run(f"{BIN}/rbfquery", "-d", rbf, stdin=b"%f %f %f" % tuple(incident)).split()
            close(f"{name} moving {n}, DHR", [dhr], float(both[name == "tf"]), 1e-4)
        # a measured incidence: pictures of fit and samples
        check(len(component["incidences"]) == len(files[name]), f"{name}: {len(component['incidences'])} incidences")
        for n in (0, len(files[name]) - 1):
            one = component["incidences"][n]
            lines = open(files[name][n]).read().split("\n")
            rows = np.array([line.split() for line in lines if line and line[0] != "#"], float)
            samples = direction(180 - rows[:, 0] if name == "tf" else rows[:, 0], rows[:, 1])
            pixels = disc(component["size"])
            close(f"{name} fit {n}", values(one["fit"]), query(rbf, direction(one["theta"], one["phi"]), outward(component, pixels, True)))
            measured, expected = values(one["measured"]), values(one["expected"])
            chosen = np.argmax(pixels @ samples.T, 1)
            seen = measured > 0
            check(seen.mean() > .95, f"{name}: only {seen.mean():.2f} of the pixels have a sample")
            # where two samples are as near as each other, either will do
            same = np.abs(measured - rows[chosen, 2]) <= 3e-4 * rows[chosen, 2]
            check(same[seen].mean() > .97, f"{name}: {1 - same[seen].mean():.3f} of the pixels do not show the nearest sample")
            fit = query(rbf, direction(one["theta"], one["phi"]), outward(component, samples[chosen], True))
            close(f"{name} fit at the samples", expected[seen & same], fit[seen & same])
        check(component["edges"], f"{name}: no edges")
        check(component["range"][0] < component["range"][1], f"{name}: no range of colours")
    # reciprocity: the mirror lobe about a turned azimuth is not reciprocal, and the report must say so
    rf = report["components"][0]
    check(all(i["reciprocity"] > .2 for i in rf["incidences"] if i["theta"] > 30), "rf: not reciprocal, but nothing is said")
    check(all(i["reciprocity"] is None for i in report["components"][1]["incidences"]), "tf alone cannot be checked for reciprocity")


PROBE = """
<script>
const probe = {errors: window.probeErrors, canvases: document.querySelectorAll("canvas").length, steps: []};
try {
	for (const name of ["rf", "tf"]) {
		const box = document.getElementById(name).querySelector(".moving").parentElement;
		const theta = box.querySelector(".theta"), phi = box.querySelector(".phi"), canvas = box.querySelector("canvas");
		const read = key => box.querySelector(`[data-key=${key}]`).textContent;
		for (const [t, p] of [[4, 0], [10, 3], [20, 7], [30, 1]]) {
			theta.value = t;
			theta.dispatchEvent(new Event("input"));
			phi.value = p;
			phi.dispatchEvent(new Event("input"));
			for (const key of ["ArrowLeft", "ArrowUp"])
				canvas.dispatchEvent(new KeyboardEvent("keydown", {key}));
			probe.steps.push({name, incidence: read("incidence"), dhr: read("dhr"), peak: read("peak"), where: read("where"),
				cursor: box.querySelector("figcaption").textContent, picture: canvas.toDataURL().length + ":" + canvas.toDataURL().slice(-400)});
		}
		const before = document.querySelector("#" + name + " .readout").textContent;
		document.querySelector("#" + name + " svg[tabindex]").dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowRight"}));
		probe[name] = [before, document.querySelector("#" + name + " .readout").textContent];
	}
} catch (error) {
	probe.errors.push(String(error));
}
probe.ready = document.documentElement.dataset.ready;
const result = document.createElement("pre");
result.id = "probe";
result.textContent = JSON.stringify(probe);
document.body.append(result);
</script>
"""
WATCH = "<script>window.probeErrors = []; window.addEventListener('error', e => probeErrors.push(e.message)); document.addEventListener('securitypolicyviolation', e => probeErrors.push(e.blockedURI));</script>"


def angles(text):
    return [float(number) for number in re.findall(r"(-?[\d.]+)°", text)]


def shown(text):
    number = re.search(r"[\d.]+(e[+-]?\d+)?", text).group(0)
    digits = re.sub(r"e.*|\.", "", number).lstrip("0")
    return float(number), .5 * 10 ** (1 - max(len(digits), 1)) * 1.1


def test_browser(browser, rbf, page, folder):
    name = f"{folder}/probe.html"
    with open(name, "w") as out:
        out.write(page.replace("<head>", "<head>" + WATCH, 1).replace("</body>", PROBE + "</body>", 1))
    dom = run(browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder}/profile", "--virtual-time-budget=20000",
              "--dump-dom", "file://" + name).decode()
    found = re.search(r'<pre id="probe">(.*?)</pre>', dom, re.S)
    if not found:
        check(False, "the page's script did not come to its end")
        return
    probe = json.loads(html.unescape(found.group(1)))
    check(probe["errors"] == [], f"errors in the browser: {probe['errors']}")
    check(probe.get("ready") == "yes" and probe["canvases"] > 20, f"not drawn: {probe['canvases']} pictures")
    for component in ("rf", "tf"):
        if component not in probe:
            continue
        check(probe[component][0] != probe[component][1], f"{component}: an arrow key does not choose another incidence")
        steps = [s for s in probe["steps"] if s["name"] == component]
        check(len(set(s["picture"] for s in steps)) == len(steps), f"{component}: the slider does not change the picture")
        for step in steps:
            incident = direction(*angles(step["incidence"]))
            side = [1, 1, -1 if component == "tf" else 1]
            dhr = float(run(f"{BIN}/rbfquery", "-d", rbf, stdin=b"%f %f %f" % tuple(incident)).split()[component == "tf"])
            value, within = shown(step["dhr"])
            close(f"{component} DHR shown, {step['incidence']}", [value], dhr, within)
            value, within = shown(step["peak"])
            close(f"{component} peak shown, {step['incidence']}", [value], query(rbf, incident, direction(*angles(step["where"])) * side), .01)
            # the cursor's direction is shown to a tenth of a degree: the value must be one from around there
            where, text = step["cursor"].split(":")
            theta, phi = angles(where)
            near = query(rbf, incident, direction(theta + np.array([0, .06, -.06, 0, 0]), phi + np.array([0, 0, 0, .06, -.06])) * side)
            value, within = shown(text)
            check(near.min() * (1 - within) <= value <= near.max() * (1 + within), f"{component} under the cursor: {step['cursor']}, rbfquery {near}")


def main():
    with tempfile.TemporaryDirectory() as folder:
        incidences = [(0, 0)] + [(t, p) for t in (25, 50) for p in range(0, 360, 60)]
        files = {"rf": measure(folder, incidences, False), "tf": measure(folder, incidences, True)}
        rbf = f"{folder}/sample.rbf"
        run(f"{BIN}/mkrbf", "-q", "-l", "60", "-s", "a", "-o", rbf, *files["rf"], *files["tf"])
        page = run(f"{BIN}/rbfreport", rbf, *files["rf"], *files["tf"]).decode()
        check(len(page.encode()) <= 5_000_000, f"{len(page)} bytes")
        check(not re.search(r"(src|href)\s*=\s*[\"']?(https?:)?//", page) and "@import" not in page, "the page asks the network")
        test_numbers(rbf, page, files)
        alone = run(f"{BIN}/rbfreport", rbf).decode()
        check(report_of(alone)["measured"] is False, "without measurements, but it says there are")

        back = subprocess.run([f"{BIN}/rbfreport", f"{folder}/none.rbf"], capture_output=True)
        check(back.returncode == 1 and b"none.rbf" in back.stderr and not back.stdout, "a missing file")
        some = subprocess.run([f"{BIN}/rbfreport", rbf, *files["rf"][:3]], capture_output=True)
        check(b"10 of the 13" in some.stderr, f"missing measurements: {some.stderr}")

        names = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
        browser = next(filter(None, map(shutil.which, names)), None)
        if browser:
            test_browser(browser, rbf, page, folder)
        else:
            print(f"skipped the browser: none of {', '.join(names)} is installed")
    print("failed" if failures else "report as it should be")
    return bool(failures)


sys.exit(main())
