// Plots with axes and units in the page's own colours: lines and points (uPlot), and the phase plane (a canvas).
// A classic script that leaves `Plots` behind, so that a page without a server can carry it too.
"use strict";

/**
 * How a column is drawn.
 * @typedef {{ colour?: string, width?: number, alpha?: number, dash?: number[], spanGaps?: boolean, bars?: boolean,
 *   invisible?: boolean, filledTo?: number, name?: string }} PlotLine
 * @typedef {[from: number, to: number]} Limits
 * @typedef {string | (() => string)} Label
 * @typedef {(min: number | null, max: number | null) => Limits} Ranged
 * @typedef {[x: number[], ...y: Column[]]} PlotColumns
 * @typedef {{ label: Label, unit?: string, range?: Ranged, size?: number }} PlotAxis
 * @typedef {{ x: number, y: number, u?: number | null, colour: string }} PlotMark
 * @typedef {{ x: number[], y: Column }} PlotTable
 * @typedef {{ x: PlotAxis, y: PlotAxis, zoomed?: (min: number | null, max: number | null) => void,
 *   pointed?: (x: number | null) => void, band?: () => number | null, ends?: PlotEnds, marks?: () => PlotMark[],
 *   places?: () => { x: number, text: string }[], cursor?: false }} PlotOptions
 * @typedef {{ at: () => Limits | null, reasons: () => string[], moved: (which: 0 | 1, x: number) => void }} PlotEnds
 * @typedef {{ resize: (width: number, height: number) => void, redraw: () => void, fit: () => void }} Drawn
 * @typedef {[yaw_deg: number, rate_deg_s: number] | null} PlaneState
 * @typedef {ReturnType<typeof Plots.lines>} LinePlot
 * @typedef {ReturnType<typeof Plots.plane>} PlanePlot
 */

const Plots = (() => {
  const FONT = '11px system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif';

  /** The page's colour of that name. @param {string | undefined} name */
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim() || "#888";

  /** A number as ticks show it, with the digits that tell it from the next, `step` on.
   * @param {number} x @param {number} [step] */
  function tick(x, step) {
    if (x === 0) return "0";
    const size = Math.abs(x);
    if (size >= 1e5 || size < 1e-4) return x.toExponential(1).replace("e+", "e").replace("-", "−");
    if (!step) return String(+x.toPrecision(5)).replace("-", "−");
    let places = Math.max(0, Math.ceil(-Math.log10(step) - 1e-9));
    if (Math.abs(step * 10 ** places - Math.round(step * 10 ** places)) > 1e-6) places++;
    return x.toFixed(Math.min(places, 12)).replace("-", "−");
  }

  /** @type {Set<Drawn>} */
  const all = new Set();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => all.forEach((plot) => plot.redraw()));

  /** Columns over one x from columns over their own; what is not there is null.
   * @param {PlotTable[]} tables @returns {PlotColumns} */
  function joined(tables) {
    const xs = [...new Set(tables.flatMap((table) => table.x))].sort((a, b) => a - b);
    const place = new Map(xs.map((x, k) => [x, k]));
    return [xs, ...tables.map((table) => {
      /** @type {Column} */
      const column = new Array(xs.length).fill(null);
      table.x.forEach((x, k) => { column[/** @type {number} */ (place.get(x))] = table.y[k]; });
      return column;
    })];
  }

  /** What is the same for every plot: it fills its host, and says so where there is nothing to draw.
   * @template {Drawn} P @param {HTMLElement} host @param {P} plot */
  function filled(host, plot) {
    const note = document.createElement("div");
    note.className = "no-data";
    note.hidden = true;
    host.append(note);
    const say = (/** @type {string | null | undefined} */ text) => { note.textContent = text || ""; note.hidden = !text; };
    new ResizeObserver(() => plot.resize(host.clientWidth, host.clientHeight)).observe(host);
    all.add(plot);
    // What it shows, for those who do not see it.
    const describe = (/** @type {string} */ text) => { host.role = "img"; host.ariaLabel = (note.hidden ? text : note.textContent ?? "").trim() || "nothing is drawn"; };
    const values = document.createElement("div");
    values.className = "pointed";
    values.hidden = true;
    host.append(values);
    /** What is under the pointer. @param {string} text */
    const tell = (text) => { values.textContent = text; values.hidden = !text; };
    return Object.assign(plot, { say, describe, tell });
  }
  // On paper a plot is as wide as its column.
  addEventListener("beforeprint", () => { document.body.classList.add("printing"); all.forEach((plot) => plot.fit()); });
  addEventListener("afterprint", () => { document.body.classList.remove("printing"); all.forEach((plot) => plot.fit()); });

  const shown = (/** @type {number} */ x) => String(+x.toPrecision(4)).replace("-", "−");
  /** With two digits of its uncertainty. @param {number} x @param {number} u */
  function uncertain(x, u) {
    const places = Math.min(Math.max(0, 1 - Math.floor(Math.log10(u))), 12);
    return `${x.toFixed(places)} ± ${u.toFixed(places)}`.replace("-", "−");
  }
  /** The unit of a label, `yaw angle (deg)`, behind its value. @param {Label} label */
  const unit = (label) => (told(label).match(/\(([^)]*)\)$/) ?? ["", ""])[1];

  /** A label, which may be what a function says at the time. @param {Label} label */
  const told = (label) => (typeof label === "function" ? label() : label);

  /**
   * Lines and points over x; `filledTo` of a line is the number of another, up to which it is filled with its colour's band.
   * options: x, y: {label, range(min, max)}; zoomed(min, max), pointed(x or null); band(): half height about zero
   * or null; ends.at(): [from, to] or null, two handles, beyond which all is pale, reasons() for them in words, and moved(0 or 1, x) where one is let go;
   * marks(): [{x, y, u, colour}] with bars of two standard uncertainties; places(): [{x, text}], dashed lines with
   * their names; cursor: false for none.
   * @param {HTMLElement} host @param {PlotOptions} options
   */
  function lines(host, options) {
    /** @type {uPlot | null} */
    let chart = null;
    /** @type {PlotColumns} */
    let data = [[]];
    /** @type {PlotLine[]} */
    let series = [];
    /** @type {{ which: 0 | 1, x: number } | null} */
    let held = null;
    let /** @type {Limits | null} */ limits = null, /** @type {number | null} */ mark = null, silent = false;
    /** Where the handles are, the one that is held where it is held. */
    function ends() {
      const at = options.ends ? options.ends.at() : null, grip = held;
      return at && grip ? at.map((x, k) => (k === grip.which ? grip.x : x)) : at;
    }
    const scale = (/** @type {uPlot} */ u) => /** @type {{ min: number, max: number }} */ (u.scales.x);
    const grips = options.ends;
    if (grips) {
      const GRIP = 7;
      const place = (/** @type {uPlot} */ u, /** @type {MouseEvent} */ event) => event.clientX - u.over.getBoundingClientRect().left;
      const under = (/** @type {MouseEvent} */ event) => {
        const u = chart, at = u && event.target instanceof Node && u.over.contains(event.target) ? ends() : null;
        if (!u || !at) return null;
        const away = at.map((x) => Math.abs(u.valToPos(x, "x") - place(u, event)));
        const which = away[0] < away[1] ? 0 : 1;
        return away[which] <= GRIP ? which : null;
      };
      // Before the plot's own, which would begin to zoom.
      host.addEventListener("mousedown", (event) => {
        const which = under(event), at = grips.at();
        if (which === null || event.button !== 0 || !at) return;
        event.stopPropagation();
        event.preventDefault();
        const grip = held = { which, x: at[which] };
        const move = (/** @type {MouseEvent} */ now) => {
          if (!chart) return;
          grip.x = Math.min(Math.max(chart.posToVal(place(chart, now), "x"), scale(chart).min), scale(chart).max);
          chart.redraw(false, false);
        };
        const end = () => {
          removeEventListener("mousemove", move, true);
          const was = grips.at();
          held = null;
          chart?.redraw(false, false);
          if (was && grip.x !== was[which]) grips.moved(which, grip.x);
        };
        addEventListener("mousemove", move, true);
        addEventListener("mouseup", end, { once: true, capture: true });
      }, true);
      host.addEventListener("mousemove", (event) => { if (chart) chart.over.style.cursor = under(event) === null ? "" : "ew-resize"; });
    }
    const { zoomed } = options;
    let /** @type {number | undefined} */ settling;
    // By the wheel alone the page is scrolled; two fingers that part are a wheel with Ctrl.
    if (zoomed) host.addEventListener("wheel", (event) => {
      if (!chart || !(event.ctrlKey || event.metaKey)) return;
      event.preventDefault();
      const { min, max } = scale(chart), x = chart.posToVal(event.clientX - chart.over.getBoundingClientRect().left, "x");
      // By the root of e for a notch of 100 pixels, by e at most.
      const share = Math.exp(Math.max(-1, Math.min(1, event.deltaY / 200)));
      const now = limits = [x - (x - min) * share, x + (max - x) * share];
      chart.setData(data, true);
      clearTimeout(settling);
      // Once the wheel has come to rest.
      settling = setTimeout(() => zoomed(...now), 150);
    }, { passive: false });
    /** @param {PlotAxis} it @param {2 | 3} side @returns {uPlot.Axis} */
    const axis = (it, side) => ({
      side, label: told(it.label) || undefined, labelSize: it.label ? 15 : 0, labelGap: 0, labelFont: FONT, font: FONT, gap: 2,
      // As wide as its numbers, unless plots above each other are to share their time.
      size: side === 2 ? 21 : it.size || ((_, values) => Math.max(30, 9 + 6.3 * Math.max(0, ...(values || []).map((v) => v.length)))), ticks: { size: 3, stroke: () => colour("line") },
      stroke: () => colour("soft"), grid: { stroke: () => colour("grid"), width: 1 },
      // Numbers side by side are apart; at least two are on the lowest of plots.
      space: side === 2
        ? (_, __, ___, max) => Math.max(host.clientWidth > 400 ? 56 : host.clientWidth > 130 ? 28 : 20, 8 + 6.3 * String(Math.round(max)).length)
        : (_, __, ___, ____, height) => Math.max(12, Math.min(20, height / 5)),
      values: (_, ticks, __, ___, step) => ticks.map((t) => (t === null ? "" : tick(t, side === 2 ? undefined : step))),
    });
    /** @type {Ranged} */
    const padded = (min, max) => {
      if (min === null || max === null || !isFinite(min) || !isFinite(max)) return [0, 1];
      const pad = (max - min) * 0.06 || Math.abs(max) * 0.02 || 1;
      return [min - pad, max + pad];
    };
    /** @param {uPlot} u */
    function extras(u) {
      const { ctx, bbox } = u;
      ctx.save();
      // A dashed line that was drawn before leaves its dashes behind.
      ctx.setLineDash([]);
      ctx.beginPath();
      ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip();
      for (const { x, y, u: deviation, colour: name } of options.marks ? options.marks() : []) {
        const px = u.valToPos(x, "x", true), py = u.valToPos(y, "y", true);
        ctx.strokeStyle = ctx.fillStyle = colour(name);
        ctx.lineWidth = devicePixelRatio;
        if (deviation && deviation > 0) {
          ctx.beginPath();
          ctx.moveTo(px, u.valToPos(y - 2 * deviation, "y", true));
          ctx.lineTo(px, u.valToPos(y + 2 * deviation, "y", true));
          ctx.stroke();
        }
        ctx.beginPath();
        ctx.arc(px, py, 2.4 * devicePixelRatio, 0, 7);
        ctx.fill();
      }
      const labels = (options.places ? options.places() : []).filter(({ x }) => x >= scale(u).min && x <= scale(u).max);
      ctx.font = FONT.replace("11px", `${11 * devicePixelRatio}px`);
      for (const [k, { x, text }] of labels.entries()) {
        const px = Math.round(u.valToPos(x, "x", true)) + 0.5, isLeft = px > bbox.left + 0.8 * bbox.width;
        ctx.strokeStyle = ctx.fillStyle = colour("ghost");
        ctx.lineWidth = devicePixelRatio;
        ctx.setLineDash([4, 3]);
        ctx.beginPath();
        ctx.moveTo(px, bbox.top);
        ctx.lineTo(px, bbox.top + bbox.height);
        ctx.stroke();
        ctx.setLineDash([]);
        ctx.textAlign = isLeft ? "right" : "left";
        // One under the other where they are close.
        ctx.fillText(text, px + (isLeft ? -4 : 4), bbox.top + (11 + 13 * (k % 3)) * devicePixelRatio);
      }
      const at = ends();
      if (at && grips) {
        for (const [k, px] of at.map((x) => Math.round(u.valToPos(x, "x", true))).entries()) {
          const outside = k === 0 ? [bbox.left, px] : [px, bbox.left + bbox.width];
          ctx.globalAlpha = 0.55;
          ctx.fillStyle = colour("card");
          ctx.fillRect(outside[0], bbox.top, Math.max(0, outside[1] - outside[0]), bbox.height);
          ctx.globalAlpha = 1;
          ctx.fillStyle = colour(held && held.which === k ? "ink" : "soft");
          ctx.fillRect(px - 0.5 * devicePixelRatio, bbox.top, devicePixelRatio, bbox.height);
          ctx.fillRect(px - 3 * devicePixelRatio, bbox.top + 0.4 * bbox.height, 6 * devicePixelRatio, 0.2 * bbox.height);
          // Outside, where there is room for it.
          ctx.font = FONT.replace("11px", `${11 * devicePixelRatio}px`);
          const reason = grips.reasons()[k], fits = outside[1] - outside[0] > ctx.measureText(reason).width + 8 * devicePixelRatio;
          ctx.textAlign = (k === 0) === fits ? "right" : "left";
          ctx.fillText(reason, px + (ctx.textAlign === "right" ? -4 : 4) * devicePixelRatio, bbox.top + bbox.height - 4 * devicePixelRatio);
        }
      }
      if (mark !== null) {
        const px = Math.round(u.valToPos(mark, "x", true)) + 0.5;
        ctx.strokeStyle = colour("ink");
        ctx.setLineDash([3, 3]);
        ctx.beginPath();
        ctx.moveTo(px, bbox.top);
        ctx.lineTo(px, bbox.top + bbox.height);
        ctx.stroke();
      }
      ctx.restore();
    }
    /** @param {uPlot} u */
    function under(u) {
      const half = options.band ? options.band() : null;
      const { ctx, bbox } = u;
      ctx.save();
      if (half) {
        const top = u.valToPos(half, "y", true), bottom = u.valToPos(-half, "y", true);
        ctx.beginPath();
        ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
        ctx.clip();
        ctx.fillStyle = colour("band");
        ctx.fillRect(bbox.left, top, bbox.width, bottom - top);
      }
      ctx.restore();
    }
    function build() {
      if (chart) chart.destroy();
      const width = host.clientWidth, height = host.clientHeight;
      chart = null;
      if (width < 40 || height < 40) return;
      chart = new uPlot({
        width, height, legend: { show: false }, padding: [6, 10, 0, 0],
        cursor: { show: options.cursor !== false, y: false, drag: { x: !!options.zoomed, y: false, setScale: false }, points: { show: false },
          bind: { dblclick: () => () => { if (options.zoomed) options.zoomed(null, null); return null; } } },
        scales: {
          x: { time: false, range: (_, min, max) => limits || (options.x.range ? options.x.range(min, max) : padded(min, max)) },
          y: { range: (_, min, max) => (options.y.range ? options.y.range(min, max) : padded(min, max)) },
        },
        axes: [axis(options.x, 2), axis(options.y, 3)],
        bands: series.flatMap((s, k) => (s.filledTo === undefined ? [] : [{ series: [k + 1, s.filledTo + 1], fill: () => colour(`${s.colour}-band`) }])),
        series: [{}, ...series.map((s) => ({
          stroke: () => colour(s.colour), width: s.width ?? 1.2, dash: s.dash, spanGaps: s.spanGaps ?? false,
          points: { show: false }, alpha: s.alpha ?? 1,
          ...(s.bars ? { paths: uPlot.paths.bars?.({ size: [0.8, 40] }), fill: () => colour(s.colour) } : {}),
          ...(s.invisible ? { paths: () => null } : {}),
        }))],
        hooks: {
          drawClear: [under], draw: [extras],
          setSelect: [(u) => {
            if (u.select.width < 4 || !options.zoomed) return;
            const from = u.posToVal(u.select.left, "x"), to = u.posToVal(u.select.left + u.select.width, "x");
            u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
            options.zoomed(from, to);
          }],
          setCursor: [(u) => {
            plot.tell(under_pointer(u));
            if (silent || !options.pointed) return;
            const { left = -1 } = u.cursor;
            options.pointed(left >= 0 ? u.posToVal(left, "x") : null);
          }],
        },
      }, data, host);
    }
    /** What the lines and points have where the cursor is. @param {uPlot} u */
    function under_pointer(u) {
      const { left = -1, idx } = u.cursor;
      if (left < 0 || idx === null || idx === undefined) return "";
      const x = data[0][idx], of = unit(options.y.label);
      const value = (/** @type {number} */ y, /** @type {number | null} */ deviation = null) => `${deviation ? uncertain(y, deviation) : shown(y)}${of && ` ${of}`}`;
      const at = (options.marks ? options.marks() : []).filter((m) => m.x === x);
      const points = at.map((m) => value(m.y, m.u));
      const curves = series.flatMap((s, k) => {
        const y = data[k + 1]?.[idx];
        return s.invisible || s.filledTo !== undefined || y === null || y === undefined ? [] : [`${s.name ? `${s.name} ` : ""}${value(y)}`];
      });
      if (!points.length && !curves.length) return "";
      return [`${shown(x)} ${options.x.unit || unit(options.x.label) || told(options.x.label)}`, ...points, ...curves].join(" · ");
    }
    let shape = "";
    const plot = filled(host, {
      /** columns: [xs, ys, ...]; how: [{colour, width, dash, bars, ...}] for each column of ys; span: x limits or null.
       * @param {PlotColumns} columns @param {PlotLine[]} how @param {Limits | null} [span] */
      set(columns, how, span) {
        data = columns; series = how; limits = span || null;
        const now = JSON.stringify([how, told(options.x.label), told(options.y.label)]);
        if (!chart || now !== shape) build(); else chart.setData(data, true);
        shape = now;
      },
      /** Shows the cursor of another plot, without telling of it. @param {number | null} x */
      point(x) {
        if (!chart) return;
        silent = true;
        const inside = x !== null && x >= scale(chart).min && x <= scale(chart).max;
        chart.setCursor(inside ? { left: chart.valToPos(x, "x"), top: 1 } : { left: -10, top: -10 }, false);
        silent = false;
      },
      /** A dashed line at x that stays. @param {number | null} x */
      mark(x) { if (x !== mark) { mark = x; if (chart) chart.redraw(false, false); } },
      resize(/** @type {number} */ width, /** @type {number} */ height) {
        if (!chart) build(); else if (width > 40 && height > 40) chart.setSize({ width, height });
      },
      redraw() { if (chart) chart.redraw(true, true); },
      fit() { plot.resize(host.clientWidth, host.clientHeight); },
    });
    return plot;
  }

  /** The plane of yaw angle and yaw rate, a colour for each cell's moment.
   * @param {HTMLElement} host @param {{ x: Label, y: Label, unit: Label, noise?: () => number, least?: number }} options */
  function plane(host, options) {
    const canvas = document.createElement("canvas");
    host.append(canvas);
    let /** @type {PhaseCell[]} */ cells = [], /** @type {PlaneState} */ state = null;
    function steps(/** @type {number} */ most) {
      const raw = most / 2, base = 10 ** Math.floor(Math.log10(raw));
      return [1, 2, 5, 10].map((k) => k * base).filter((s) => s <= raw * 1.3).pop() || base;
    }
    function draw() {
      const width = host.clientWidth, height = host.clientHeight, ratio = devicePixelRatio || 1;
      if (width < 40 || height < 40) return;
      canvas.width = width * ratio; canvas.height = height * ratio;
      canvas.style.width = `${width}px`; canvas.style.height = `${height}px`;
      const g = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
      g.scale(ratio, ratio);
      g.clearRect(0, 0, width, height);
      under = () => "";
      if (!cells.length) return;
      const xs = [...new Set(cells.map((c) => c[0]))].sort((a, b) => a - b), ys = [...new Set(cells.map((c) => c[1]))].sort((a, b) => a - b);
      const gap = (/** @type {number[]} */ v) => v.slice(1).reduce((m, x, k) => Math.min(m, x - v[k]), Infinity);
      const dx = gap(xs), dy = gap(ys), mx = Math.max(...xs.map(Math.abs)) + dx / 2, my = Math.max(...ys.map(Math.abs)) + dy / 2;
      const box = { left: 44, top: 5, width: width - 50, height: height - 5 - 34 - 20 };
      const px = (/** @type {number} */ x) => box.left + (x + mx) / (2 * mx) * box.width, py = (/** @type {number} */ y) => box.top + (my - y) / (2 * my) * box.height;
      // Its noise keeps its pale colour, however little else there is: the scale reaches to `least` times it.
      const noise = options.noise ? options.noise() : 0, most = cells.reduce((most, c) => Math.max(most, Math.abs(c[2])), (options.least ?? 1) * noise) || 1;
      g.fillStyle = colour("level");
      g.fillRect(box.left, box.top, box.width, box.height);
      for (const [x, y, moment] of cells) {
        const share = Math.max(-1, Math.min(1, moment / most));
        g.globalAlpha = Math.abs(share);
        g.fillStyle = colour(share > 0 ? "plus" : "minus");
        g.fillRect(px(x - dx / 2), py(y + dy / 2), px(x + dx / 2) - px(x - dx / 2) + 0.4, py(y - dy / 2) - py(y + dy / 2) + 0.4);
      }
      under = (left, top) => {
        const cell = cells.find(([x, y]) => Math.abs(px(x) - left) <= (px(dx) - px(0)) / 2 && Math.abs(py(y) - top) <= (py(0) - py(dy)) / 2);
        return cell ? `${shown(cell[0])} ${unit(options.x)}, ${shown(cell[1])} ${unit(options.y)}: ${shown(cell[2])} ${told(options.unit)}` : "";
      };
      g.globalAlpha = 1;
      g.strokeStyle = colour("line");
      g.strokeRect(box.left + 0.5, box.top + 0.5, box.width, box.height);
      g.setLineDash([2, 3]);
      g.strokeStyle = colour("soft");
      g.beginPath();
      g.moveTo(px(0), box.top); g.lineTo(px(0), box.top + box.height);
      g.moveTo(box.left, py(0)); g.lineTo(box.left + box.width, py(0));
      g.stroke();
      g.setLineDash([]);
      g.font = FONT; g.fillStyle = colour("soft"); g.textAlign = "center";
      for (const s of [-1, 0, 1]) g.fillText(tick(s * steps(mx)), px(s * steps(mx)), box.top + box.height + 12);
      g.textAlign = "right";
      for (const s of [-1, 0, 1]) g.fillText(tick(s * steps(my)), box.left - 4, py(s * steps(my)) + 4);
      g.textAlign = "center";
      g.fillText(told(options.x), box.left + box.width / 2, box.top + box.height + 26);
      g.save();
      g.translate(11, box.top + box.height / 2);
      g.rotate(-Math.PI / 2);
      g.fillText(told(options.y), 0, 0);
      g.restore();
      // The scale of the colours.
      const top = height - 15;
      for (let k = 0; k < 60; k++) {
        const share = k / 29.5 - 1;
        g.globalAlpha = 1; g.fillStyle = colour("level");
        g.fillRect(box.left + k * box.width / 60, top, box.width / 60 + 0.5, 5);
        g.globalAlpha = Math.abs(share); g.fillStyle = colour(share > 0 ? "plus" : "minus");
        g.fillRect(box.left + k * box.width / 60, top, box.width / 60 + 0.5, 5);
      }
      g.globalAlpha = 1; g.fillStyle = colour("soft");
      // Twice the noise to either side.
      for (const side of noise > 0 ? [-1, 1] : []) g.fillRect(box.left + (1 + side * 2 * noise / most) / 2 * box.width - 0.5, top - 2, 1, 9);
      g.textAlign = "left"; g.fillText(tick(+(-most).toPrecision(2)), box.left, height - 1);
      g.textAlign = "right"; g.fillText(`${tick(+most.toPrecision(2))} ${told(options.unit)}`, box.left + box.width, height - 1);
      if (state) {
        g.beginPath();
        g.arc(px(state[0]), py(state[1]), 4, 0, 7);
        g.fillStyle = colour("ink"); g.fill();
        g.strokeStyle = colour("card"); g.stroke();
      }
    }
    let /** @type {((x: number, y: number) => string)} */ under = () => "";
    host.addEventListener("mousemove", (event) => { const box = host.getBoundingClientRect(); plot.tell(under(event.clientX - box.left, event.clientY - box.top)); });
    host.addEventListener("mouseleave", () => plot.tell(""));
    const plot = filled(host, {
      set(/** @type {PhaseCell[]} */ now) { cells = now; draw(); },
      /** A state, or null. @param {PlaneState} at */
      point(at) { if (at !== state) { state = at; draw(); } },
      resize: draw, redraw: draw, fit: draw,
    });
    return plot;
  }

  return { lines, plane, joined, colour, tick, uncertain };
})();
