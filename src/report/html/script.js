"use strict";
(() => {
  const all = (selector, root = document) => [...root.querySelectorAll(selector)];

  // ---- tables: sort by any column, filter by words and verdict ----
  const key = (cell, numeric) => {
    const sort = cell.dataset.sort;
    if (numeric) return sort !== undefined ? Number(sort) : cell.textContent.trim() === "" ? Infinity : Number.parseFloat(cell.textContent);
    return sort !== undefined ? sort : cell.textContent.trim();
  };
  const compare = (a, b, numeric) => {
    if (!numeric) return a.localeCompare(b, "en", { numeric: true });
    const lost = x => Number.isNaN(x);
    if (lost(a) || lost(b)) return Number(lost(a)) - Number(lost(b));
    return a < b ? -1 : a > b ? 1 : 0;
  };
  for (const table of all("table.sortable")) {
    const heads = all("thead th", table);
    heads.forEach((head, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const down = head.getAttribute("aria-sort") === "ascending";
        const numeric = head.classList.contains("number");
        const body = table.tBodies[0];
        const rows = [...body.rows].map(row => [key(row.cells[column], numeric), row]);
        rows.sort((a, b) => (down ? -1 : 1) * compare(a[0], b[0], numeric));
        for (const [, row] of rows) body.append(row);
        for (const other of heads) other.removeAttribute("aria-sort");
        head.setAttribute("aria-sort", down ? "descending" : "ascending");
      });
    });
  }
  for (const block of all(".table-block")) {
    const filter = block.querySelector(".filter");
    if (!filter) continue;
    filter.hidden = false;
    const rows = all("tbody tr", block);
    const boxes = all("input[type=checkbox]", filter);
    for (const box of boxes) {
      const number = rows.filter(row => row.dataset.status === box.value).length;
      box.parentElement.append(` (${number})`);
    }
    const search = filter.querySelector("input[type=search]");
    const update = () => {
      const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
      const allowed = new Set(boxes.filter(box => box.checked).map(box => box.value));
      let shown = 0;
      for (const row of rows) {
        const text = row.textContent.toLowerCase();
        row.hidden = !(allowed.has(row.dataset.status) && words.every(word => text.includes(word)));
        shown += row.hidden ? 0 : 1;
      }
      filter.querySelector(".count").textContent = `${shown} of ${rows.length}`;
    };
    filter.addEventListener("input", update);
    update();
  }

  // ---- figures that zoom together ----
  for (const group of all(".figures.zoom, .stops, .compare")) {
    const panes = all(".pane", group);
    if (!panes.length) continue;
    let zoom = 1, x = 0, y = 0; // x, y: what is at the top left corner, as shares of the picture
    const show = () => {
      x = Math.min(Math.max(x, 0), 1 - 1 / zoom);
      y = Math.min(Math.max(y, 0), 1 - 1 / zoom);
      group.classList.toggle("zoomed", zoom > 1);
      for (const pane of panes) {
        pane.firstElementChild.style.transform = `scale(${zoom}) translate(${-100 * x}%, ${-100 * y}%)`;
      }
    };
    const place = (event, pane) => {
      const box = pane.getBoundingClientRect();
      return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
    };
    const to = (factor, u = 0.5, v = 0.5) => {
      const next = Math.min(Math.max(zoom * factor, 1), 32);
      x += u / zoom - u / next;
      y += v / zoom - v / next;
      zoom = next;
      show();
    };
    const tools = document.createElement("div");
    tools.className = "zoom-tools";
    const button = (text, label, act) => {
      const made = document.createElement("button");
      made.type = "button";
      made.textContent = text;
      made.setAttribute("aria-label", label);
      made.addEventListener("click", act);
      tools.append(made);
    };
    button("+", "zoom in", () => to(2));
    button("−", "zoom out", () => to(0.5));
    button("reset", "show all", () => { zoom = 1; show(); });
    tools.append(panes.length > 1 ? "together; double-click zooms in, dragging moves" : "double-click zooms in, dragging moves");
    const first = group.querySelector(".reading");
    if (first) first.before(tools);
    else if (group.classList.contains("figures")) group.append(tools);
    else group.querySelector(".stop, h4").before(tools);

    const reader = hover(group);
    for (const pane of panes) {
      let last = null, moved = false;
      const pointers = new Map();
      pane.addEventListener("dblclick", event => { event.preventDefault(); to(2, ...place(event, pane)); });
      pane.addEventListener("wheel", event => {
        if (!event.ctrlKey) return; // the page scrolls as ever
        event.preventDefault();
        to(event.deltaY < 0 ? 1.25 : 0.8, ...place(event, pane));
      }, { passive: false });
      pane.addEventListener("pointerdown", event => {
        pointers.set(event.pointerId, place(event, pane));
        last = place(event, pane);
        if (zoom > 1) pane.setPointerCapture(event.pointerId);
      });
      const away = event => { pointers.delete(event.pointerId); last = null; };
      pane.addEventListener("pointerup", away);
      pane.addEventListener("pointercancel", away);
      pane.addEventListener("pointermove", event => {
        const [u, v] = place(event, pane);
        reader?.(x + u / zoom, y + v / zoom);
        if (!pointers.has(event.pointerId)) return;
        if (pointers.size === 2) {
          const other = [...pointers.entries()].find(([id]) => id !== event.pointerId)[1];
          const before = pointers.get(event.pointerId);
          const distance = p => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1e-6;
          to(distance([u, v]) / distance(before), (u + other[0]) / 2, (v + other[1]) / 2);
        } else if (last && zoom > 1) {
          x -= (u - last[0]) / zoom;
          y -= (v - last[1]) / zoom;
          last = [u, v];
          show();
        }
        pointers.set(event.pointerId, [u, v]);
      });
      pane.addEventListener("click", event => {
        const [u, v] = place(event, pane);
        reader?.(x + u / zoom, y + v / zoom);
      });
    }
  }

  // What is counted where the pointer is, as a sentence under the figures.
  function hover(group) {
    const data = group.querySelector("script.hover");
    const line = group.querySelector(".reading");
    if (!data || !line) return null;
    let cells = null, index = null;
    const read = () => {
      cells = JSON.parse(data.textContent);
      const image = new Image();
      image.onload = () => {
        const canvas = document.createElement("canvas");
        canvas.width = image.width;
        canvas.height = image.height;
        const context = canvas.getContext("2d", { willReadFrequently: true });
        context.drawImage(image, 0, 0);
        index = context.getImageData(0, 0, image.width, image.height);
      };
      image.src = cells.index;
    };
    line.textContent = "point at a cell to read its counts";
    return (u, v) => {
      if (!cells) read();
      if (!index) return;
      const column = Math.min(Math.max(Math.floor(u * index.width), 0), index.width - 1);
      const row = Math.min(Math.max(Math.floor(v * index.height), 0), index.height - 1);
      const at = 4 * (row * index.width + column);
      const [red, green, blue] = index.data.subarray(at, at + 3);
      if (!blue) { line.textContent = "outside of the cells"; return; }
      const i = red + 256 * green + 65536 * (blue - 1);
      // As the report has it: the counts of a comparison vary less.
      const [n, m, observed, expected] = [cells.samples, cells.others, cells.observed[i], cells.expected[i]];
      const spread = Math.sqrt(expected * (1 - expected / n) * (m > 0 ? m / (n + m) : 1));
      const sigma = spread > 0 ? Number(((observed - expected) / spread).toFixed(2)) : null;
      const where = cells.places ? `; ${cells.places[i]}` : "";
      line.textContent = `observed ${observed}, expected ${expected}, residual ${sigma === null ? "–" : (sigma > 0 ? "+" : "") + sigma} σ${where}`;
    };
  }

  // ---- sliders over figures ----
  for (const block of all(".stops")) {
    const stops = all(".stop", block);
    const control = block.querySelector(".control");
    if (stops.length < 2) continue;
    control.hidden = false;
    const range = control.querySelector("input");
    const update = () => {
      stops.forEach((stop, i) => { stop.style.display = i === Number(range.value) ? "" : "none"; });
      control.querySelector("output").textContent = stops[Number(range.value)].dataset.name;
    };
    range.addEventListener("input", update);
    update();
  }

  // ---- two pictures over one another ----
  for (const block of all(".compare")) {
    const viewer = block.querySelector(".viewer");
    const figures = all(".figures", block).flatMap(group => all(".figure", group).map(figure => ({
      name: `${group.dataset.group}: ${figure.dataset.name}`,
      group: group.dataset.group,
      image: figure.querySelector("img"),
    })));
    if (figures.length < 2) continue;
    viewer.hidden = false;
    const [left, right] = [".left", ".right"].map(s => viewer.querySelector(s));
    figures.forEach((figure, i) => {
      for (const select of [left, right]) select.add(new Option(figure.name, i));
    });
    left.value = 0;
    right.value = Math.max(figures.findIndex((f, i) => i > 0 && f.group === figures[0].group), 1);
    const [under, over] = [".under", ".over"].map(s => viewer.querySelector(s));
    const range = viewer.querySelector("input[type=range]");
    const edge = viewer.querySelector(".edge");
    const update = () => {
      const [a, b] = [figures[left.value], figures[right.value]];
      if (over.src !== a.image.src) over.src = a.image.src;
      if (under.src !== b.image.src) under.src = b.image.src;
      over.alt = `left: ${a.image.alt}`;
      under.alt = `right: ${b.image.alt}`;
      over.style.clipPath = `inset(0 ${100 - range.value}% 0 0)`;
      edge.style.left = `calc(${range.value}% - 1px)`;
    };
    viewer.addEventListener("input", update);
    const stack = viewer.querySelector(".stack");
    const slide = event => {
      if (event.buttons !== 1) return;
      const box = stack.getBoundingClientRect();
      range.value = 100 * (event.clientX - box.left) / box.width;
      update();
    };
    stack.addEventListener("pointerdown", slide);
    stack.addEventListener("pointermove", slide);
    update();
  }

  // ---- links into what is closed; paper shows all ----
  const open = () => {
    const target = location.hash.length > 1 && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    for (let node = target; node; node = node.parentElement) if (node.tagName === "DETAILS") node.open = true;
    if (target) target.scrollIntoView();
  };
  addEventListener("hashchange", open);
  open();
  let opened = [];
  addEventListener("beforeprint", () => {
    opened = all("details:not([open])");
    for (const details of opened) details.open = true;
  });
  addEventListener("afterprint", () => { for (const details of opened) details.open = false; });
})();
