"use strict";
/* SPDX-License-Identifier: BSD-3-Clause
 * Draws the report from `report`, which rbfreport wrote. Nothing is computed here that the library computes: pictures,
 * profiles and values come from it; this file turns them into colours, curves and words. */

const DEG = Math.PI / 180;
/* As in json.h: 16-bit logarithms. */
const CODE_LOW = 1e-6, CODE_HIGH = 1e6, CODE_STEPS = 65534;
const FRAME_COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7"]; // Okabe and Ito
const NOTHING = [226, 229, 233];

/* ------------------------------------------------------------------ numbers */

function decode(text) {
	const raw = atob(text), bytes = new Uint8Array(raw.length);
	for (let i = 0; i < raw.length; i++)
		bytes[i] = raw.charCodeAt(i);
	return bytes;
}
function words(text) {
	const bytes = decode(text), all = new Uint16Array(bytes.length >> 1);
	for (let i = 0; i < all.length; i++)
		all[i] = bytes[2 * i] | bytes[2 * i + 1] << 8;
	return all;
}
const valueOf = code => code ? CODE_LOW * (CODE_HIGH / CODE_LOW) ** ((code - 1) / CODE_STEPS) : 0;
const codeOf = value => value > 0 ? 1 + Math.log(value / CODE_LOW) / Math.log(CODE_HIGH / CODE_LOW) * CODE_STEPS : 0;
const unitOf = code => code / 65535 * 2 - 1;

function show(value, digits = 3) {
	if (value === null || value === undefined || Number.isNaN(value))
		return "–";
	if (value === 0)
		return "0";
	const size = Math.abs(value);
	return size >= 1e5 || size < 1e-3 ? value.toExponential(digits - 1) : Number(value.toPrecision(digits)).toString();
}
const percent = value => value === null ? "–" : (100 * value).toPrecision(value < .0995 ? 2 : 3) + " %";
const angle = value => (Math.round(value * 10) / 10).toFixed(1).replace("-0.0", "0.0") + "°";
const pair = (theta, phi) => "θ " + angle(theta) + "  φ " + angle(phi);

/* -------------------------------------------------------------------- marks */

function element(name, attributes = {}, ...children) {
	const node = document.createElement(name);
	for (const [key, value] of Object.entries(attributes))
		key === "class" ? node.className = value : node.setAttribute(key, value);
	node.append(...children);
	return node;
}
function drawn(name, attributes = {}, ...children) {
	const node = document.createElementNS("http://www.w3.org/2000/svg", name);
	for (const [key, value] of Object.entries(attributes))
		node.setAttribute(key, value);
	node.append(...children);
	return node;
}

/* ------------------------------------------------------------------- colours */

function ramp(stops) {
	const table = [];
	for (let i = 0; i < 256; i++) {
		const at = i / 255 * (stops.length - 1), n = Math.min(Math.floor(at), stops.length - 2), t = at - n;
		const channel = k => parseInt(stops[n].substr(1 + 2 * k, 2), 16) * (1 - t) + parseInt(stops[n + 1].substr(1 + 2 * k, 2), 16) * t;
		table.push([0, 1, 2].map(k => Math.round(channel(k))));
	}
	return table;
}
/* viridis (Smith and van der Walt, CC0): even in lightness, and told apart by colour-blind eyes */
const VIRIDIS = ramp(["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"]);
const DIVERGING = ramp(["#123f7a", "#5b93c7", "#f7f7f7", "#e0954a", "#9a4300"]);
const pick = (table, share) => table[Math.round(Math.min(Math.max(share, 0), 1) * 255)];

/* ------------------------------------------------------------------ the disc */

/* Index of each pixel of a disc, -1 outside: the same pixels, in the same order, as view.c's. */
const discs = new Map();
function disc(size) {
	if (discs.has(size))
		return discs.get(size);
	const index = new Int32Array(size * size).fill(-1);
	let count = 0;
	for (let row = 0; row < size; row++)
		for (let column = 0; column < size; column++) {
			const x = 2 * column + 1 - size, y = size - 1 - 2 * row;
			if (x * x + y * y < size * size)
				index[row * size + column] = count++;
		}
	discs.set(size, index);
	return index;
}
function pixelAngles(size, row, column) {
	const x = 2 * column + 1 - size, y = size - 1 - 2 * row;
	return {theta: Math.hypot(x, y) / size * 90, phi: (Math.atan2(y, x) / DEG + 360) % 360};
}

/* Paints a disc. colour(pixel index) gives [r, g, b]. Marks: {theta, phi, kind} with kind "in" (incident) or "peak". */
function paint(canvas, size, colour, marks = []) {
	const index = disc(size), ratio = canvas.small ? 1 : 2, side = canvas.side;
	const small = document.createElement("canvas");
	small.width = small.height = size;
	const context = small.getContext("2d"), image = context.createImageData(size, size);
	for (let i = 0; i < size * size; i++) {
		/* the pixels around the rim repeat the nearest one within, so that smoothing does not darken the rim */
		let n = index[i];
		if (n < 0) {
			const row = Math.floor(i / size), column = i % size, x = 2 * column + 1 - size, y = size - 1 - 2 * row;
			const scale = (size - 1.5) / Math.hypot(x, y);
			const c = Math.round((x * scale + size - 1) / 2), r = Math.round((size - 1 - y * scale) / 2);
			n = index[r * size + c];
		}
		const [r, g, b] = n < 0 ? [255, 255, 255] : colour(n);
		image.data.set([r, g, b, 255], 4 * i);
	}
	context.putImageData(image, 0, 0);
	canvas.width = canvas.height = side * ratio;
	canvas.style.width = canvas.style.height = side + "px";
	const to = canvas.getContext("2d"), middle = side / 2, radius = canvas.small ? middle - 1 : middle - 16;
	to.scale(ratio, ratio);
	to.clearRect(0, 0, side, side);
	to.save();
	to.beginPath();
	to.arc(middle, middle, radius, 0, 2 * Math.PI);
	to.clip();
	to.imageSmoothingEnabled = !canvas.raw;
	to.drawImage(small, middle - radius, middle - radius, 2 * radius, 2 * radius);
	to.restore();
	if (canvas.small)
		return;
	to.strokeStyle = "rgba(255,255,255,.55)";
	to.lineWidth = 1;
	for (const theta of [30, 60]) {
		to.beginPath();
		to.arc(middle, middle, radius * theta / 90, 0, 2 * Math.PI);
		to.stroke();
	}
	to.beginPath();
	to.moveTo(middle - radius, middle);
	to.lineTo(middle + radius, middle);
	to.moveTo(middle, middle - radius);
	to.lineTo(middle, middle + radius);
	to.stroke();
	to.fillStyle = "#5b6675";
	to.font = "11px system-ui, sans-serif";
	to.textAlign = "center";
	to.textBaseline = "middle";
	to.fillText("x", side - 7, middle);
	to.fillText("y", middle, 7);
	for (const mark of marks) {
		const x = middle + radius * mark.theta / 90 * Math.cos(mark.phi * DEG), y = middle - radius * mark.theta / 90 * Math.sin(mark.phi * DEG);
		for (const [width, style] of [[3.5, "rgba(0,0,0,.75)"], [1.5, "#fff"]]) {
			to.lineWidth = width;
			to.strokeStyle = style;
			to.beginPath();
			if (mark.kind === "in")
				to.arc(x, y, 5, 0, 2 * Math.PI);
			else {
				to.moveTo(x - 5, y);
				to.lineTo(x + 5, y);
				to.moveTo(x, y - 5);
				to.lineTo(x, y + 5);
			}
			to.stroke();
		}
	}
}

/* A canvas for discs, with a caption that reads the pixel under the pointer or, after arrow keys, under the cursor. */
function discFigure(title, side) {
	const canvas = element("canvas", {role: "img", tabindex: "0", "aria-label": title}), caption = element("figcaption");
	caption.setAttribute("aria-live", "polite");
	canvas.side = side;
	const figure = element("figure", {}, element("b", {}, title), canvas, caption);
	const state = {figure, canvas, caption, size: 0, read: null, cursor: null};
	const tell = (row, column) => {
		const n = row >= 0 && column >= 0 && row < state.size && column < state.size ? disc(state.size)[row * state.size + column] : -1;
		if (n < 0 || !state.read)
			return false;
		const at = pixelAngles(state.size, row, column);
		caption.textContent = pair(at.theta, at.phi) + ":  " + state.read(n);
		return true;
	};
	canvas.addEventListener("pointermove", event => {
		const box = canvas.getBoundingClientRect(), rim = 16 / side * box.width, width = box.width - 2 * rim;
		const column = Math.floor((event.clientX - box.left - rim) / width * state.size);
		const row = Math.floor((event.clientY - box.top - rim) / width * state.size);
		if (tell(row, column))
			state.cursor = [row, column];
	});
	canvas.addEventListener("keydown", event => {
		const step = {ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1]}[event.key];
		if (!step)
			return;
		event.preventDefault();
		const [row, column] = state.cursor || [state.size >> 1, state.size >> 1];
		if (tell(row + step[0], column + step[1]))
			state.cursor = [row + step[0], column + step[1]];
	});
	return state;
}

function colourBar(range) {
	const width = 300, svg = drawn("svg", {width: width + 60, height: 40, viewBox: `0 0 ${width + 60} 40`, role: "img",
		"aria-label": `colours from ${show(range[0])} to ${show(range[1])} per steradian, logarithmic`});
	for (let i = 0; i < 100; i++)
		svg.append(drawn("rect", {x: 10 + i * width / 100, y: 2, width: width / 100 + .6, height: 14, fill: `rgb(${pick(VIRIDIS, i / 99)})`}));
	const low = Math.log10(range[0]), high = Math.log10(range[1]);
	for (let e = Math.ceil(low); e <= high; e++)
		svg.append(drawn("line", {x1: 10 + (e - low) / (high - low) * width, x2: 10 + (e - low) / (high - low) * width, y1: 16, y2: 20, class: "axis"}),
			drawn("text", {x: 10 + (e - low) / (high - low) * width, y: 31, "text-anchor": "middle"}, show(10 ** e, 1)));
	svg.append(drawn("text", {x: width + 16, y: 13}, "f, 1/sr"));
	return element("figure", {}, svg);
}
function differenceBar() {
	const width = 200, svg = drawn("svg", {width: width + 60, height: 40, viewBox: `0 0 ${width + 60} 40`, role: "img",
		"aria-label": "difference: blue, measured half of the fit; white, equal; orange, twice"});
	for (let i = 0; i < 100; i++)
		svg.append(drawn("rect", {x: 30 + i * width / 100, y: 2, width: width / 100 + .6, height: 14, fill: `rgb(${pick(DIVERGING, i / 99)})`}));
	[["÷ 2", 0], ["equal", .5], ["× 2", 1]].forEach(([text, at]) =>
		svg.append(drawn("text", {x: 30 + at * width, y: 31, "text-anchor": "middle"}, text)));
	return element("figure", {}, svg);
}

/* -------------------------------------------------------------------- charts */

/* series: {points: [[x, y], ...], colour, line, dots, name}; y may be logarithmic. */
function chart({width = 520, height = 250, x, y, xText, yText, log, series, mark, label}) {
	const left = 58, right = 12, top = 10, bottom = 36;
	const svg = drawn("svg", {width, height, viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label || yText + " against " + xText});
	const toY = value => log ? Math.log10(Math.max(value, y[0])) : value;
	const low = toY(y[0]), high = toY(y[1]);
	const px = value => left + (value - x[0]) / (x[1] - x[0]) * (width - left - right);
	const py = value => height - bottom - (Math.min(Math.max(toY(value), low), high) - low) / (high - low) * (height - top - bottom);
	const ticks = (a, b, most) => {
		const raw = (b - a) / most, power = 10 ** Math.floor(Math.log10(raw));
		const step = [1, 2, 5, 10].map(n => n * power).find(n => n >= raw * .999);
		const all = [];
		for (let n = Math.ceil(a / step - 1e-9); n * step <= b + 1e-9 * step; n++)
			all.push(Number((n * step).toPrecision(6)));
		return all;
	};
	const xTicks = x[1] - x[0] === 180 ? [-90, -60, -30, 0, 30, 60, 90] : x[1] === 90 ? [0, 15, 30, 45, 60, 75, 90] : ticks(x[0], x[1], 7);
	for (const tick of xTicks)
		svg.append(drawn("line", {x1: px(tick), x2: px(tick), y1: top, y2: height - bottom, class: "grid"}),
			drawn("text", {x: px(tick), y: height - bottom + 14, "text-anchor": "middle"}, String(tick)));
	const yTicks = log ? [] : ticks(y[0], y[1], 5);
	for (let e = Math.ceil(low); log && e <= high; e++)
		yTicks.push(10 ** e);
	for (const tick of yTicks)
		svg.append(drawn("line", {x1: left, x2: width - right, y1: py(tick), y2: py(tick), class: "grid"}),
			drawn("text", {x: left - 6, y: py(tick) + 4, "text-anchor": "end"}, show(tick, 2)));
	svg.append(drawn("polyline", {points: `${left},${top} ${left},${height - bottom} ${width - right},${height - bottom}`, class: "axis"}));
	svg.append(drawn("text", {x: (left + width - right) / 2, y: height - 4, "text-anchor": "middle"}, xText),
		drawn("text", {x: 12, y: (top + height - bottom) / 2, "text-anchor": "middle", transform: `rotate(-90 12 ${(top + height - bottom) / 2})`}, yText));
	for (const one of series) {
		if (one.line)
			svg.append(drawn("polyline", {points: one.points.map(p => px(p[0]).toFixed(1) + "," + py(p[1]).toFixed(1)).join(" "), fill: "none",
				stroke: one.colour, "stroke-width": 1.8, "stroke-linejoin": "round", "stroke-dasharray": one.dash || "none"}));
		else
			for (const p of one.points)
				svg.append(drawn("circle", {cx: px(p[0]).toFixed(1), cy: py(p[1]).toFixed(1), r: one.radius || 2.4, fill: one.colour, "fill-opacity": one.opacity || 1}));
	}
	if (mark !== undefined)
		svg.append(drawn("line", {x1: px(mark), x2: px(mark), y1: top, y2: height - bottom, stroke: "#e69f00", "stroke-width": 1.5}));
	return svg;
}
function keys(list) {
	const line = element("div");
	for (const [colour, text] of list) {
		const dot = element("i");
		dot.style.background = colour;
		line.append(element("span", {class: "key"}, dot, text));
	}
	return line;
}
const DASHES = ["none", "7 3", "2 3", "9 3 2 3", "4 2", "12 4", "1 2", "6 2 1 2"];
const CURVE_COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#8a6d00", "#444444", "#7b3fa0"];

/* ----------------------------------------------------------- the incident mesh */

const toDirection = (theta, phi) => [Math.sin(theta * DEG) * Math.cos(phi * DEG), Math.sin(theta * DEG) * Math.sin(phi * DEG), Math.cos(theta * DEG)];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/* The mirror images that the symmetry gives, as signs of x and y. */
function images(component) {
	const [x, y, turn] = component.mirrors, all = [[1, 1]];
	if (component.symmetry === "I")
		return all;
	if (x)
		all.push([-1, 1]);
	if (y)
		all.push([1, -1]);
	if ((x && y) || turn)
		all.push([-1, -1]);
	return all;
}

/* Is an incident direction within the measured ones? */
function isInside(component, theta, phi) {
	if (component.symmetry === "I") {
		const angles = component.vertices.map(v => Math.atan2(v[0], v[2]) / DEG);
		return theta <= Math.max(...angles) + .01 && theta >= Math.min(...angles) - .01;
	}
	return images(component).some(([x, y]) => {
		const d = toDirection(theta, phi);
		d[0] *= x;
		d[1] *= y;
		return component.triangles.some(t => {
			const [a, b, c] = t.map(n => component.vertices[n]);
			return dot(cross(a, b), d) > -1e-5 && dot(cross(b, c), d) > -1e-5 && dot(cross(c, a), d) > -1e-5;
		});
	});
}

function meshFigure(component, state) {
	const side = 400, middle = side / 2, radius = middle - 18;
	const place = d => {
		const s = Math.hypot(d[0], d[1]), r = s > 0 ? Math.atan2(s, d[2]) / DEG / 90 * radius : 0;
		return s > 0 ? [middle + r * d[0] / s, middle - r * d[1] / s] : [middle, middle];
	};
	const svg = drawn("svg", {width: side, height: side, viewBox: `0 0 ${side} ${side}`, tabindex: "0", role: "application",
		"aria-label": "Incident directions. Arrow keys choose the next or the previous one."});
	svg.append(drawn("defs", {}, drawn("pattern", {id: "hatch-" + component.name, width: 6, height: 6, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)"},
		drawn("rect", {width: 6, height: 6, fill: "#fff"}), drawn("line", {x1: 0, y1: 0, x2: 0, y2: 6, stroke: "#cfd5dc", "stroke-width": 2}))));
	svg.append(drawn("circle", {cx: middle, cy: middle, r: radius, fill: `url(#hatch-${component.name})`, stroke: "#9aa4b1"}));
	const isotropic = component.symmetry === "I";
	if (isotropic) { // any azimuth: the measured rings
		const angles = component.vertices.map(v => Math.atan2(v[0], v[2]) / DEG), low = Math.max(0, Math.min(...angles));
		svg.append(drawn("circle", {cx: middle, cy: middle, r: Math.max(...angles) / 90 * radius, fill: "#eaf1f6", stroke: "#9db4c6"}));
		if (low > 0)
			svg.append(drawn("circle", {cx: middle, cy: middle, r: low / 90 * radius, fill: `url(#hatch-${component.name})`, stroke: "#9db4c6"}));
		for (const one of component.incidences)
			svg.append(drawn("circle", {cx: middle, cy: middle, r: one.theta / 90 * radius, fill: "none", stroke: "#9db4c6", "stroke-dasharray": "3 3"}));
	}
	const line = (a, b, attributes) => { // along the great circle
		const points = [];
		for (let n = 0; n <= 6; n++)
			points.push(place(a.slice(0, 3).map((value, k) => value * (1 - n / 6) + b[k] * n / 6)).map(v => v.toFixed(1)).join(","));
		return drawn("polyline", {points: points.join(" "), fill: "none", ...attributes});
	};
	const all = images(component);
	all.slice().reverse().forEach(([x, y]) => {
		const own = x > 0 && y > 0, turned = component.vertices.map(v => [v[0] * x, v[1] * y, v[2]]);
		if (isotropic)
			return;
		for (const t of component.triangles)
			svg.append(drawn("polygon", {points: [0, 1, 2].map(k => {
				const a = turned[t[k]], b = turned[t[(k + 1) % 3]], points = [];
				for (let n = 0; n < 4; n++)
					points.push(place(a.map((value, i) => value * (1 - n / 4) + b[i] * n / 4)).map(v => v.toFixed(1)).join(","));
				return points.join(" ");
			}).join(" "), fill: own ? "#eaf1f6" : "#f6f9fb", stroke: own ? "#9db4c6" : "#d3dee7", "stroke-width": own ? 1 : .7}));
	});
	for (const theta of [30, 60])
		svg.append(drawn("circle", {cx: middle, cy: middle, r: radius * theta / 90, class: "axis", "stroke-width": .6, "stroke-dasharray": "2 4"}),
			drawn("text", {x: middle + 3, y: middle - radius * theta / 90 - 3}, theta + "°"));
	svg.append(drawn("text", {x: side - 8, y: middle + 4, "text-anchor": "middle"}, "x"), drawn("text", {x: middle, y: 11, "text-anchor": "middle"}, "y"));
	if (!isotropic)
		component.edges.forEach(([a, b], n) => {
			const hit = line(component.vertices[a], component.vertices[b], {stroke: "transparent", "stroke-width": 7, style: "cursor:pointer"});
			hit.append(drawn("title", {}, "edge: show how the lobes move along it"));
			hit.addEventListener("click", () => state.chooseEdge(n, false));
			svg.append(hit);
		});
	const edgeMark = drawn("g"), chosenMark = drawn("g");
	svg.append(edgeMark);
	/* measured incidences by their leave-one-out error, mirrored ones hollow */
	const errors = component.incidences.map(one => one.leaveOneOut).filter(e => e !== null);
	const worst = Math.max(...errors, 1e-9);
	const circle = (d, attributes) => drawn("circle", {cx: place(d)[0].toFixed(1), cy: place(d)[1].toFixed(1), ...attributes});
	if (!isotropic)
		for (const [x, y] of all.slice(1))
			component.incidences.forEach(one => {
				const d = toDirection(one.theta, one.phi);
				svg.append(circle([d[0] * x, d[1] * y, d[2]], {r: 2.2, fill: "#fff", stroke: "#8796a5"}));
			});
	component.incidences.forEach((one, n) => {
		const mark = circle(toDirection(one.theta, one.phi), {r: 5, stroke: "#1c2430", "stroke-width": .8, style: "cursor:pointer",
			fill: one.leaveOneOut === null ? "#fff" : `rgb(${pick(VIRIDIS, 1 - one.leaveOneOut / worst)})`});
		mark.append(drawn("title", {}, pair(one.theta, one.phi) + (one.leaveOneOut === null ? "" : ", leave-one-out error " + show(one.leaveOneOut))));
		mark.addEventListener("click", () => state.choose(n));
		svg.append(mark);
	});
	svg.append(chosenMark);
	svg.addEventListener("keydown", event => {
		const step = {ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1}[event.key];
		if (step) {
			event.preventDefault();
			state.step(step);
		}
	});
	state.onChoose.push(n => {
		const one = component.incidences[n];
		chosenMark.replaceChildren(circle(toDirection(one.theta, one.phi), {r: 8.5, fill: "none", stroke: "#e69f00", "stroke-width": 3}));
	});
	state.onEdge.push((from, to) =>
		edgeMark.replaceChildren(line(component.vertices[from], component.vertices[to], {stroke: "#e69f00", "stroke-width": 3.5})));
	const figure = element("figure", {}, svg);
	if (errors.length) {
		const low = Math.min(...errors);
		figure.append(keys([[`rgb(${pick(VIRIDIS, 1 - low / worst)})`, "leave-one-out error " + show(low, 2)], [`rgb(${pick(VIRIDIS, 0)})`, show(worst, 2)]]
			.concat(errors.length < component.incidences.length ? [["#fff", "not known"]] : [])));
	}
	figure.append(element("figcaption", {}, (isotropic ? "Isotropic: measured rings stand for all azimuths." : all.length > 1
		? "Filled: measured. Hollow: mirror images." : "Filled: measured.") + " Hatched: outside, where the nearest incidence is carried on."));
	return figure;
}

/* ------------------------------------------------------ one incidence, measured */

function incidenceView(component, state) {
	const range = component.range, low = codeOf(range[0]), high = codeOf(range[1]);
	const figures = {fit: discFigure(report.measured ? "Fit" : "Fit of this incidence", 330)};
	if (report.measured) {
		figures.measured = discFigure("Measurement", 330);
		figures.difference = discFigure("Measured ÷ fit", 330);
	}
	const profile = element("div"), label = element("b");
	const pictured = component.incidences.map((one, n) => one.fit ? n : -1).filter(n => n >= 0);
	const select = element("select", {"aria-label": "Incident direction"});
	for (const n of pictured)
		select.append(element("option", {value: n}, pair(component.incidences[n].theta, component.incidences[n].phi)));
	const button = (text, title, step) => {
		const node = element("button", {type: "button", title}, text);
		node.addEventListener("click", () => state.step(step));
		return node;
	};
	select.addEventListener("change", () => state.choose(Number(select.value)));
	const readout = element("span", {class: "readout"});
	const controls = element("div", {class: "controls"}, element("label", {}, "Incidence ", select),
		button("◀", "previous incidence", -1), button("▶", "next incidence", 1), readout);
	const colour = code => pick(VIRIDIS, (code - low) / (high - low));

	state.step = step => {
		const at = pictured.indexOf(state.chosen);
		state.choose(pictured[(at + step + pictured.length) % pictured.length]);
	};
	state.onChoose.push(n => {
		const one = component.incidences[n];
		select.value = n;
		readout.textContent = `DHR ${show(one.dhr)} · peak ${show(one.peak[0])} sr⁻¹ at ${pair(one.peak[1], one.peak[2])} · ${one.lobes} lobes`
			+ (one.samples ? ` · ${one.samples} samples` : "") + (one.leaveOneOut === null ? "" : ` · leave-one-out error ${show(one.leaveOneOut)}`);
		if (!one.fit)
			return;
		const marks = [{theta: one.peak[1], phi: one.peak[2], kind: "peak"}];
		if (component.name[0] === "r")
			marks.push({theta: one.theta, phi: one.phi, kind: "in"});
		const fit = words(one.fit), size = component.size;
		const set = (view, read, paintIt) => {
			view.size = size;
			view.read = read;
			view.caption.textContent = "";
			paint(view.canvas, size, paintIt, marks);
		};
		set(figures.fit, i => "f " + show(valueOf(fit[i])) + " sr⁻¹", i => colour(fit[i]));
		if (report.measured) {
			const none = new Uint16Array(fit.length), measured = one.measured ? words(one.measured) : none, expected = one.expected ? words(one.expected) : none;
			const ratio = i => measured[i] > 1 && expected[i] > 1 ? (measured[i] - expected[i]) / CODE_STEPS * Math.log2(CODE_HIGH / CODE_LOW) : null;
			figures.measured.canvas.raw = figures.difference.canvas.raw = true;
			set(figures.measured, i => measured[i] ? "nearest sample " + show(valueOf(measured[i])) + " sr⁻¹" : "not measured",
				i => measured[i] ? colour(measured[i]) : NOTHING);
			set(figures.difference, i => ratio(i) === null ? "not compared" : "measured is " + show(100 * 2 ** ratio(i)) + " % of the fit",
				i => ratio(i) === null ? NOTHING : pick(DIVERGING, (ratio(i) + 1) / 2));
		}
		/* the profile */
		const line = words(one.profile), points = [], near = [];
		for (let i = 0; i < line.length; i += 2)
			points.push([unitOf(line[i]) * 90, valueOf(line[i + 1])]);
		if (one.near) {
			const all = words(one.near);
			for (let i = 0; i < all.length; i += 2)
				if (all[i + 1])
					near.push([unitOf(all[i]) * 90, valueOf(all[i + 1])]);
		}
		const shown = points.map(p => p[1]).concat(near.map(p => p[1])), top = Math.max(...shown) * 1.5;
		const bottom = Math.max(Math.min(...shown.filter(v => v > 0)), top * 1e-6) * .8;
		const logSeries = [{points, colour: "#0072b2", line: true}, {points: near, colour: "#d55e00", opacity: .75}];
		const whole = chart({width: 540, height: 260, x: [-90, 90], y: [bottom, top], log: true, xText: `θ in the plane φ = ${angle(one.plane)}, degrees`, yText: "f, 1/sr", series: logSeries,
			label: "Profile through the peak, logarithmic"});
		const centre = one.plane === undefined ? 0 : one.peak[1], half = 10;
		const within = list => list.filter(p => Math.abs(p[0] - centre) <= half);
		const best = Math.max(...within(points).concat(within(near)).map(p => p[1])) * 1.05;
		const close = chart({width: 400, height: 260, x: [Math.max(centre - half, -90), Math.min(centre + half, 90)], y: [0, best], xText: "θ about the peak, degrees", yText: "f, 1/sr",
			series: [{points: within(points), colour: "#0072b2", line: true}, {points: within(near), colour: "#d55e00", opacity: .75}],
			label: "Profile about the peak, linear"});
		profile.replaceChildren(element("div", {class: "row"}, whole, close), keys(one.near ? [["#0072b2", "fit"], ["#d55e00",
			`samples within ${one.band}° of the plane`]] : [["#0072b2", "fit"]]));
	});
	const order = report.measured ? [figures.measured, figures.fit, figures.difference] : [figures.fit];
	const bars = element("div", {class: "row"}, colourBar(range));
	if (report.measured)
		bars.append(differenceBar());
	const box = element("div", {}, controls, element("div", {class: "row"}, ...order.map(f => f.figure)), bars, label,
		element("h3", {}, "Profile through the peak"), profile);
	return box;
}

/* All incidences at a glance. */
function contactSheet(component, state) {
	const sheet = element("div", {class: "sheet"}), low = codeOf(component.range[0]), high = codeOf(component.range[1]), buttons = [];
	component.incidences.forEach((one, n) => {
		if (!one.fit)
			return;
		const canvas = element("canvas", {"aria-hidden": "true"}), fit = words(one.fit);
		canvas.side = 76;
		canvas.small = true;
		paint(canvas, component.size, i => pick(VIRIDIS, (fit[i] - low) / (high - low)));
		const node = element("button", {type: "button", "aria-pressed": "false"}, canvas, `${angle(one.theta)} ${component.symmetry === "I" ? "" : angle(one.phi)}`);
		node.addEventListener("click", () => state.choose(n));
		buttons[n] = node;
		sheet.append(node);
	});
	state.onChoose.push(n => buttons.forEach((node, i) => node.setAttribute("aria-pressed", String(i === n))));
	return sheet;
}

/* ----------------------------------------------------- a moving incidence */

function movingView(component) {
	const moving = component.moving, low = codeOf(component.range[0]), high = codeOf(component.range[1]);
	const view = discFigure("Interpolated hemisphere", 400);
	const slider = (text, most, className) => {
		const input = element("input", {type: "range", min: 0, max: most - 1, step: 1, value: 0, class: className, "aria-label": text}), output = element("output");
		input.addEventListener("input", update);
		return {input, output, label: element("label", {}, text, input, output)};
	};
	const theta = slider("θ", moving.thetas, "theta"), phi = slider("φ", moving.phis, "phi");
	const reading = element("dl", {class: "reading"});
	const inside = element("p", {class: "warning"}, "This incidence lies outside the measured ones: the nearest is carried on.");
	function update() {
		const t = Number(theta.input.value) * moving.thetaStep, p = moving.phiFirst + Number(phi.input.value) * moving.phiStep;
		const [dhr, peak, peakTheta, peakPhi, text] = moving.at[Number(phi.input.value) * moving.thetas + Number(theta.input.value)];
		const fit = words(text), marks = [{theta: peakTheta, phi: peakPhi, kind: "peak"}];
		if (component.name[0] === "r")
			marks.push({theta: t, phi: p, kind: "in"});
		theta.output.textContent = angle(t);
		phi.output.textContent = angle(p);
		theta.input.setAttribute("aria-valuetext", t + " degrees");
		phi.input.setAttribute("aria-valuetext", p + " degrees");
		view.size = moving.size;
		view.read = i => "f " + show(valueOf(fit[i])) + " sr⁻¹";
		paint(view.canvas, moving.size, i => pick(VIRIDIS, (fit[i] - low) / (high - low)), marks);
		if (view.cursor) // what stands below the picture follows
			view.canvas.dispatchEvent(new CustomEvent("follow"));
		const rows = [["Incidence", pair(t, p), "incidence"], ["DHR", show(dhr, 4), "dhr"], ["Peak of f |cos|", `${show(peak, 4)} sr⁻¹`, "peak"],
			["Peak direction", pair(peakTheta, peakPhi), "where"]];
		reading.replaceChildren(...rows.flatMap(([name, value, key]) => [element("dt", {}, name), element("dd", {"data-key": key}, value)]));
		inside.hidden = isInside(component, t, p);
	}
	view.canvas.addEventListener("follow", () => {
		const n = disc(view.size)[view.cursor[0] * view.size + view.cursor[1]], at = pixelAngles(view.size, ...view.cursor);
		view.caption.textContent = pair(at.theta, at.phi) + ":  " + view.read(n);
	});
	theta.input.value = Math.round(30 / moving.thetaStep);
	const controls = element("div", {class: "controls moving"}, theta.label);
	if (moving.phis > 1)
		controls.append(phi.label);
	const box = element("div", {}, controls, element("div", {class: "row"}, view.figure, element("div", {class: "beside"}, reading, inside,
		element("p", {class: "reading"}, "Point at the disc, or move through it by arrow keys, to read values."))), colourBar(component.range));
	update();
	return box;
}

/* ------------------------------------------------------- transport along an edge */

function edgeView(component, state) {
	const side = 400, canvas = element("canvas", {role: "img"}), caption = element("figcaption");
	canvas.side = side;
	const select = element("select", {"aria-label": "Edge of the mesh"}), vertex = n => {
		const v = component.vertices[n];
		return pair(Math.atan2(Math.hypot(v[0], v[1]), v[2]) / DEG, Math.hypot(v[0], v[1]) > 1e-6 ? (Math.atan2(v[1], v[0]) / DEG + 360.0001) % 360 : 0);
	};
	component.edges.forEach(([a, b], n) => select.append(element("option", {value: n}, `${vertex(a)}  →  ${vertex(b)}`)));
	const reverse = element("button", {type: "button"}, "reverse");
	const legend = element("div");
	let chosen = 0, back = false;
	state.chooseEdge = (n, turned) => {
		chosen = n;
		back = turned;
		select.value = n;
		const [a, b, forth, other] = component.edges[n], from = back ? b : a, to = back ? a : b;
		const bytes = decode(back ? other : forth), size = 41;
		paint(canvas, size, () => [242, 245, 248]);
		const context = canvas.getContext("2d"), middle = side / 2, radius = middle - 16;
		context.strokeStyle = "#9aa4b1";
		context.lineWidth = 1;
		for (const share of [1 / 3, 2 / 3, 1]) {
			context.beginPath();
			context.arc(middle, middle, radius * share, 0, 2 * Math.PI);
			context.stroke();
		}
		const word = at => bytes[at] | bytes[at + 1] << 8;
		let shown = 0, energy = 0, most = 0;
		const lobes = [];
		for (let at = 0; at + 12 <= bytes.length; at += 12) {
			const p = [0, 2, 4, 6].map(k => unitOf(word(at + k)));
			lobes.push({p, share: word(at + 8) / 65535, frame: bytes[at + 10], stays: bytes[at + 11]});
			most = Math.max(most, word(at + 8) / 65535);
		}
		for (const lobe of lobes.reverse()) { // the strongest last, on top
			const [x, y, u, v] = lobe.p.map((value, k) => middle + (k % 2 ? -value : value) * radius);
			context.strokeStyle = context.fillStyle = FRAME_COLOURS[lobe.frame];
			context.globalAlpha = .35 + .65 * Math.sqrt(lobe.share / most);
			context.lineWidth = .8 + 3 * Math.sqrt(lobe.share / most);
			context.beginPath();
			context.arc(x, y, 1.5 + 3.5 * Math.sqrt(lobe.share / most), 0, 2 * Math.PI);
			context.fill();
			energy += lobe.share;
			shown++;
			if (!lobe.stays) {
				context.beginPath();
				context.moveTo(x - 5, y - 5);
				context.lineTo(x + 5, y + 5);
				context.moveTo(x - 5, y + 5);
				context.lineTo(x + 5, y - 5);
				context.stroke();
				continue;
			}
			const length = Math.hypot(u - x, v - y);
			if (length < 2)
				continue;
			const c = (u - x) / length, s = (v - y) / length, head = Math.min(8, length * .6);
			context.beginPath();
			context.moveTo(x, y);
			context.lineTo(u, v);
			context.moveTo(u - head * (c * .87 - s * .5), v - head * (s * .87 + c * .5));
			context.lineTo(u, v);
			context.lineTo(u - head * (c * .87 + s * .5), v - head * (s * .87 - c * .5));
			context.stroke();
		}
		context.globalAlpha = 1;
		canvas.setAttribute("aria-label", `Lobes moving from incidence ${vertex(from)} to ${vertex(to)}`);
		caption.textContent = `Incidence ${vertex(from)} → ${vertex(to)}. The ${shown} strongest lobes, ${percent(energy)} of the energy; `
			+ "arrows lead to where they are at the other end. A cross: the lobe sinks below the horizon or ends.";
		for (const listen of state.onEdge)
			listen(from, to);
	};
	select.addEventListener("change", () => state.chooseEdge(Number(select.value), back));
	reverse.addEventListener("click", () => state.chooseEdge(chosen, !back));
	legend.append(keys(component.frames.map((frame, n) => [FRAME_COLOURS[n], `${frame.name}, ${percent(frame.share)} of the energy`])));
	const text = component.residual ? `Lobes move with their frame and, beyond it, by a residual of ${show(component.residualDegrees, 2)}° on average.`
		: "Lobes move with their frame alone: no residual transport was needed.";
	const scope = component.edges.length < component.edgesInAll ? ` ${component.edges.length} of ${component.edgesInAll} edges are in this file.` : "";
	return element("div", {}, element("div", {class: "controls"}, element("label", {}, "Edge ", select), reverse),
		element("div", {class: "row"}, element("figure", {}, canvas), element("div", {class: "beside"}, legend, element("p", {}, text + scope), caption)));
}

/* ------------------------------------------------------------------- checks */


const perIncidence = (component, key, title, width) => {
	const points = component.incidences.map(one => [one.theta, one[key]]).filter(p => p[1] !== null);
	if (!points.length)
		return "";
	const limit = Math.max(...points.map(p => p[1]));
	return element("figure", {}, element("b", {}, title), chart({width, height: 205, x: [0, 90], y: [0, limit * 1.1 || 1], xText: "incident θ, degrees",
		yText: "relative error", series: [{points, colour: "#0072b2", radius: 3, opacity: .8}], label: title}));
};
function dhrFigure(component, width) {
	const incidences = component.incidences;
	const measured = incidences.filter(one => one.dhr !== null).map(one => [one.theta, one.dhr]);
	const dhrs = component.curves.flatMap(c => c.dhr).concat(measured.map(p => p[1])), top = Math.max(...dhrs, 1e-6);
	return element("figure", {}, element("b", {}, "DHR against incidence"), chart({width, height: 205, x: [0, 90], y: [0, top * 1.08], xText: "incident θ, degrees",
		yText: "DHR", label: "DHR against incidence", series: component.curves.map((c, n) => ({points: c.dhr.map((v, i) => [2 * i, v]), colour: CURVE_COLOURS[n % 8],
			dash: DASHES[n % 8], line: true})).concat([{points: measured, colour: "#1c2430", radius: 2.6}])}),
		keys(component.curves.map((c, n) => [CURVE_COLOURS[n % 8], component.symmetry === "I" ? "any azimuth" : `φ ${c.phi}°`]).concat([["#1c2430", "measured incidences"]])));
}
/* Reflectance and transmittance of one incident side must not exceed 1 together. */
function energyText(component) {
	const most = component.incidences.reduce((a, b) => b.total > a.total ? b : a, component.incidences[0]);
	if (!most || most.total === null)
		return null;
	const other = report.components.some(c => c !== component && c.name[1] === component.name[1]);
	const what = other ? "Reflectance and transmittance together reach" : "DHR reaches", where = `${show(most.total)} at ${pair(most.theta, most.phi)}`;
	return {text: `${what} ${where}` + (component.excess ? `: more light than arrives, at ${component.excess} of ${component.incidences.length} incidences. The measurement's scale should be checked.` : "."),
		bad: component.excess > 0};
}

function incidenceTable(component) {
	const table = element("table", {}, element("thead", {}, element("tr", {}, ...["θ", "φ", "samples", "lobes", "DHR", "total", "peak, sr⁻¹", "peak θ", "peak φ", "fit error", "leave-one-out", "reciprocity"]
		.map(text => element("th", {scope: "col"}, text))))), body = element("tbody");
	for (const one of component.incidences)
		body.append(element("tr", {}, ...[one.theta.toFixed(2), one.phi.toFixed(2), one.samples || "–", one.lobes, show(one.dhr, 4), show(one.total, 4), show(one.peak[0], 4), one.peak[1].toFixed(2), one.peak[2].toFixed(2),
			show(one.fitError), show(one.leaveOneOut), show(one.reciprocity)].map(text => element("td", {}, String(text)))));
	table.append(body);
	return element("details", {}, element("summary", {}, `Table of the ${component.incidences.length} incidences`), table);
}

/* ------------------------------------------------------------------ the page */

function summary(component) {
	const box = element("div"), mean = (key) => {
		const all = component.incidences.map(one => one[key]).filter(v => v !== null);
		return all.length ? all.reduce((a, b) => a + b, 0) / all.length : null;
	};
	const frames = component.frames.map(f => `${f.name} ${percent(f.share)}`).join(", ");
	const facts = [["Incidences", component.incidences.length, `to θ ${angle(component.thetaMax)}`], ["Lobes", component.lobes, `${Math.round(component.lobes / component.incidences.length)} each`],
		["Fit error", show(component.fitError), "held-out samples"], ["Leave-one-out", show(component.leaveOneOut), "left-out incidences"],
		["Expected error", show(component.expected), "between measured incidences"],
		["Reciprocity", show(mean("reciprocity")), mean("reciprocity") === null ? "other side not measured" : "mean difference"],
		["Asymmetry", show(component.asymmetry), component.asymmetry === null ? "cannot be told" : "against the symmetry"],
		["Lambertian part", show(component.lambertian), "reflectance or transmittance"]];
	const list = element("dl", {class: "facts"});
	for (const [name, value, note] of facts)
		list.append(element("div", {}, element("dt", {}, name), element("dd", {}, String(value), " ", element("small", {}, note))));
	box.append(element("p", {class: "lead"}, `Symmetry: ${component.symmetryText}. Frames: ${frames}`
		+ (component.residual ? `, with residual transport of ${show(component.residualDegrees, 2)}° on average.` : ".")), list);
	const warn = text => box.append(element("p", {class: "warning"}, text));
	const energy = energyText(component);
	if (energy)
		box.append(element("p", {class: energy.bad ? "warning" : "lead"}, energy.text));
	if (component.leaveOneOut > .5)
		warn(`Left-out incidences are predicted with an error of ${percent(component.leaveOneOut)}: expect little between the measured ones, or measure more of them.`);
	if (component.pictured < component.incidences.length)
		warn(`Pictures of ${component.pictured} of the ${component.incidences.length} incidences are in this file, evenly chosen.`);
	const missing = component.incidences.filter(one => !one.samples).length;
	if (report.measured && missing)
		warn(`No measurement was given of ${missing} of the ${component.incidences.length} incidences.`);
	return box;
}

function section(component) {
	const state = {onChoose: [], onEdge: [], chosen: -1, choose: null, chooseEdge: null, step: null};
	state.choose = n => {
		state.chosen = n;
		for (const listen of state.onChoose)
			listen(n);
	};
	const view = incidenceView(component, state);
	const node = element("section", {id: component.name}, element("h2", {}, component.title + " ", element("code", {}, component.name)), summary(component),
		element("h3", {}, "Incident directions and checks"), element("div", {class: "row"}, meshFigure(component, state), element("div", {class: "column"},
			dhrFigure(component, 600), perIncidence(component, "leaveOneOut", "Leave-one-out error of each incidence", 600),
			perIncidence(component, "reciprocity", "Reciprocity: difference of f(i, o) and f(o, i)", 600))), incidenceTable(component),
		element("h3", {}, report.measured ? "Measurement and fit" : "Fit"), view, element("h3", {}, "All incidences"), contactSheet(component, state),
		element("h3", {}, "Between the measured incidences"), movingView(component));
	if (component.edges.length)
		node.append(element("h3", {}, "Frames and transport along an edge"), edgeView(component, state));
	const first = component.incidences.map((one, n) => [Math.abs(one.theta - 40), n]).filter(([, n]) => component.incidences[n].fit).sort((a, b) => a[0] - b[0])[0];
	if (first)
		state.choose(first[1]);
	if (component.edges.length)
		state.chooseEdge(Math.floor(component.edges.length / 2), false);
	return node;
}

(function start() {
	const name = report.name || report.file;
	document.title = name + " – BSDF report";
	document.getElementById("title").textContent = name;
	const sources = report.source ? report.source.split("\n") : [];
	document.getElementById("subtitle").textContent = [report.file, report.command, sources.length ? `${sources.length} measurement file${sources.length > 1 ? "s" : ""}` : "", report.channels === 3 ? "colour; luminance shown" : ""]
		.filter(Boolean).join(" · ");
	document.getElementById("made").textContent = `Made by rbfreport ${report.version}` + (report.measured ? "." : "; the measurements were not given to it.");
	if (report.components.length > 1)
		for (const component of report.components)
			document.getElementById("nav").append(element("a", {href: "#" + component.name}, component.title));
	for (const component of report.components)
		document.getElementById("main").append(section(component));
	if (sources.length)
		document.getElementById("reading").before(element("details", {}, element("summary", {}, "Measurement files"), element("p", {}, sources.join(", "))));
	document.documentElement.dataset.ready = "yes";
})();
window.addEventListener("beforeprint", () => document.querySelectorAll("details").forEach(node => node.open = true));
