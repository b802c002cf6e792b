"use strict";
// The overlays of a report: drawn when they come to be seen, with one cursor and one zoom for both plots of a release.
(() => {
  /** @type {ReportData} */
  const report = JSON.parse(document.getElementById("report-data")?.textContent ?? "{}");
  const colour = (/** @type {string} */ name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const axis = (/** @type {string} */ label) => ({
    label, stroke: () => colour("--ink"), labelFont: "13px system-ui, sans-serif", font: "12px system-ui, sans-serif",
    grid: { stroke: () => colour("--line"), width: 1 }, ticks: { stroke: () => colour("--line"), width: 1 },
  });
  /** @type {(digits: number) => uPlot.Series.Value} */
  const number = digits => (_, value) => value == null ? "-" : value.toFixed(digits);
  /** @type {uPlot[]} */
  const drawn = [];

  /**
   * @param {HTMLElement} box @param {number} release @param {string} title @param {string} label @param {number} height
   * @param {uPlot.Series[]} series @param {uPlot.AlignedData} values
   */
  function plot(box, release, title, label, height, series, values) {
    const options = {
      title, width: box.clientWidth, height,
      scales: { x: { time: false } },
      axes: [axis("time from the release (s)"), { ...axis(label), size: 70 }],
      cursor: { sync: { key: "release-" + release } },
      series: [{ label: "time (s)", value: number(3) }, ...series],
    };
    const chart = new uPlot(options, values, box);
    Object.assign(chart.ctx.canvas, { role: "img", ariaLabel: `${label} over time from the release (s): ${series.map(s => s.label).join(", ")}` });
    drawn.push(chart);
    // What is closed has no width.
    new ResizeObserver(() => { if (box.clientWidth) chart.setSize({ width: box.clientWidth, height }); }).observe(box);
    return chart;
  }

  function draw(/** @type {HTMLElement} */ figure) {
    if (figure.dataset.drawn) return;
    figure.dataset.drawn = "yes";
    const index = Number(figure.dataset.release), trace = report.releases[index].trace;
    /** @type {HTMLElement | null} */
    const box = figure.querySelector(".plots");
    if (!trace || !box) return;
    const { quantity = "angle", unit = "deg", amplitude_unit = "deg", motion = "yaw" } = trace.said || {};
    /** @type {Record<string, string>} */
    const names = { rate: amplitude_unit === "deg" ? `${motion} rate` : "rate", acceleration: "acceleration", displacement: "displacement" };
    const name = names[quantity] || `${motion} angle`;
    /** @type {(label: string, k: number, width: number, dash?: number[]) => uPlot.Series} */
    const line = (label, k, width, dash) =>
      ({ label, stroke: () => colour("--curve-" + (k % 7 + 1)), width, dash, value: number(4), points: { show: false } });
    const plots = [
      plot(box, index, name[0].toUpperCase() + name.slice(1), `${name} (${unit})`, 300,
        [{ ...line("measured", 6, 1.5) }, ...trace.models.map((m, k) => line(m.name, k, 1.2, k ? [6, 4] : undefined))],
        [trace.time_s, trace.measured_deg, ...trace.models.map(m => m.yaw_deg)]),
      plot(box, index, "Residual: measured less model", `residual (${unit})`, 230,
        trace.models.map((m, k) => line(m.name, k, 1)),
        [trace.time_s, ...trace.models.map(m => m.residual_deg)]),
    ];
    let busy = false;
    for (const one of plots) {
      const follow = () => {
        if (busy) return;
        busy = true;
        const { min, max } = /** @type {{ min: number, max: number }} */ (one.scales.x);
        for (const other of plots) if (other !== one) other.setScale("x", { min, max });
        busy = false;
      };
      (one.hooks.setScale ||= []).push((_, key) => key === "x" && follow());
    }
  }

  const figures = [.../** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("figure.live"))];
  // Browsers lay out what a closed one holds, so that its size tells nothing.
  const seen = () => figures.filter(f => !f.closest("details:not([open])")).forEach(draw);
  seen();
  document.querySelectorAll("details").forEach(d => d.addEventListener("toggle", seen));
  // A table that is wider than its place is scrolled by keys, too.
  const tables = new ResizeObserver(entries => {
    for (const { target: e } of entries) {
      if (e.scrollWidth > e.clientWidth) Object.assign(e, { tabIndex: 0, role: "group", ariaLabel: "table" });
      else for (const name of ["tabindex", "role", "aria-label"]) e.removeAttribute(name);
    }
  });
  document.querySelectorAll(".wide").forEach(e => tables.observe(e));
  const again = () => drawn.forEach(chart => chart.redraw(false, true));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
  // On paper the colours are those of the light page.
  matchMedia("print").addEventListener("change", again);

  function save(/** @type {Blob} */ blob, /** @type {string} */ name) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    URL.revokeObjectURL(link.href);
  }

  // A drawing as an image of its own, in the colours of a light page, which stand in it.
  /** @param {SVGSVGElement} svg @returns {Promise<{ one: HTMLImageElement, width: number, height: number }>} */
  function image(svg) {
    const { width, height } = svg.viewBox.baseVal;
    const copy = /** @type {SVGSVGElement} */ (svg.cloneNode(true));
    for (const [name, value] of [["xmlns", "http://www.w3.org/2000/svg"], ["width", `${width}`], ["height", `${height}`]]) copy.setAttribute(name, value);
    copy.setAttribute("font-family", "sans-serif");
    return new Promise((done, fail) => {
      const one = new Image();
      one.onload = () => done({ one, width, height });
      one.onerror = fail;
      one.src = "data:image/svg+xml;charset=utf-8," + encodeURIComponent(copy.outerHTML);
    });
  }

  // All drawings of a figure below each other, two pixels for each of theirs.
  async function png(/** @type {Element} */ figure, /** @type {string} */ name) {
    const parts = await Promise.all([...figure.querySelectorAll("svg")].map(image));
    const canvas = document.createElement("canvas"), scale = 2;
    canvas.width = scale * Math.max(...parts.map(p => p.width));
    canvas.height = scale * parts.reduce((sum, p) => sum + p.height, 0);
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    pen.fillStyle = "#ffffff";
    pen.fillRect(0, 0, canvas.width, canvas.height);
    let y = 0;
    for (const { one, width, height } of parts) {
      pen.drawImage(one, 0, y, scale * width, scale * height);
      y += scale * height;
    }
    canvas.toBlob(blob => { if (blob) save(blob, name); }, "image/png");
  }

  document.querySelectorAll("main > section figure").forEach((figure, k) => {
    if (!figure.querySelector(":scope > svg") || figure.closest(".small")) return;
    const button = document.createElement("button");
    button.type = "button";
    button.className = "save";
    button.textContent = "PNG";
    button.title = "Save this drawing as a PNG file";
    button.addEventListener("click", () => png(figure, "drawing-" + (k + 1) + ".png"));
    figure.querySelector("figcaption")?.before(button);
  });

  document.getElementById("save-data")?.addEventListener("click", () =>
    save(new Blob([JSON.stringify(report, null, 1)], { type: "application/json" }), "report.json"));
})();
