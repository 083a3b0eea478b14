// Readings of a figure answer to the pointer and to the keyboard, figures can be enlarged, and what is folded is printed.
// The page is whole without this script.  It asks for nothing, and all text goes into the page as text, never as markup.
"use strict";
(() => {
  const texts = JSON.parse(document.getElementById("points").textContent);
  const REACH = 24; // pixels from the pointer to a reading that answers
  const SVG = "http://www.w3.org/2000/svg";

  for (const figure of document.querySelectorAll("figure")) {
    const svg = figure.querySelector(".card svg");
    if (!svg) continue;
    allowZoom(figure, svg);
    const marks = [];
    for (const group of svg.querySelectorAll("g[id]")) {
      if (!Object.hasOwn(texts, group.id)) continue;
      const own = [...group.querySelectorAll("use")];
      if (own.length !== texts[group.id].length) continue;
      own.forEach((mark, k) => marks.push({ mark, group: own, k, text: texts[group.id][k] }));
    }
    if (marks.length) letAnswer(figure, svg, marks);
  }

  function letAnswer(figure, svg, marks) {
    svg.setAttribute("role", "group"); // an image would hide its readings from screen readers
    const tip = figure.appendChild(document.createElement("div"));
    tip.className = "tip";
    tip.setAttribute("role", "tooltip");
    tip.hidden = true;
    const ring = document.createElementNS(SVG, "circle");
    for (const [name, value] of Object.entries({ r: 6, fill: "none", stroke: "#d55e00", "stroke-width": 1.8 }))
      ring.setAttribute(name, value);
    ring.style.pointerEvents = "none";

    const hide = () => {
      tip.hidden = true;
      ring.remove();
    };
    const show = (one) => {
      tip.textContent = one.text;
      tip.hidden = false;
      ring.setAttribute("cx", one.mark.x.baseVal.value);
      ring.setAttribute("cy", one.mark.y.baseVal.value);
      svg.append(ring);
      const at = ring.getBoundingClientRect();
      const inside = figure.getBoundingClientRect();
      const left = at.left + at.width / 2 - inside.left - tip.offsetWidth / 2;
      const above = at.top - inside.top - tip.offsetHeight - 6;
      tip.style.left = `${Math.max(0, Math.min(left, inside.width - tip.offsetWidth))}px`;
      tip.style.top = `${above < 0 ? at.bottom - inside.top + 6 : above}px`;
    };
    const nearest = (event) => {
      const matrix = svg.getScreenCTM();
      const place = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
      let found = null;
      let least = REACH / matrix.a;
      for (const one of marks) {
        const distance = Math.hypot(one.mark.x.baseVal.value - place.x, one.mark.y.baseVal.value - place.y);
        if (distance < least) [found, least] = [one, distance];
      }
      return found;
    };
    const look = (event) => {
      const one = nearest(event);
      one ? show(one) : hide();
    };
    svg.addEventListener("pointermove", look);
    svg.addEventListener("pointerdown", look);
    svg.addEventListener("pointerleave", hide);

    // one stop of the tabulator for each row of readings, and arrows along it
    const steps = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1, Home: -1e9, End: 1e9 };
    for (const one of marks) {
      one.mark.setAttribute("tabindex", one.k === 0 ? "0" : "-1");
      one.mark.setAttribute("role", "img");
      one.mark.setAttribute("aria-label", one.text.replaceAll("\n", ", "));
      one.mark.addEventListener("focus", () => show(one));
      one.mark.addEventListener("blur", hide);
      one.mark.addEventListener("keydown", (event) => {
        if (event.key === "Escape") hide();
        if (!(event.key in steps)) return;
        event.preventDefault();
        const next = one.group[Math.max(0, Math.min(one.k + steps[event.key], one.group.length - 1))];
        one.mark.setAttribute("tabindex", "-1");
        next.setAttribute("tabindex", "0");
        next.focus();
      });
    }
  }

  // A part of it as large as the whole, by the box of the drawing that is seen.
  function allowZoom(figure, svg) {
    const whole = svg.viewBox.baseVal;
    const [left, top, width, height] = [whole.x, whole.y, whole.width, whole.height];
    const view = { x: left, y: top, scale: 1 };
    const card = figure.querySelector(".card");
    const set = (x, y, scale) => {
      view.scale = Math.max(1, Math.min(scale, 16));
      const [w, h] = [width / view.scale, height / view.scale];
      view.x = Math.max(left, Math.min(x, left + width - w));
      view.y = Math.max(top, Math.min(y, top + height - h));
      svg.setAttribute("viewBox", `${view.x} ${view.y} ${w} ${h}`);
      card.classList.toggle("zoomed", view.scale > 1);
    };
    const times = (factor) => {
      const [w, h] = [width / view.scale, height / view.scale];
      set(view.x + (w - w / factor) / 2, view.y + (h - h / factor) / 2, view.scale * factor);
    };
    const showWhole = () => set(left, top, 1);
    const bar = document.createElement("div");
    bar.className = "zoom";
    const buttons = [["+", "Enlarge", () => times(2)], ["−", "Reduce", () => times(0.5)], ["⟲", "Whole", showWhole]];
    for (const [sign, name, act] of buttons) {
      const button = bar.appendChild(document.createElement("button"));
      button.type = "button";
      button.textContent = sign;
      button.title = name;
      button.setAttribute("aria-label", `${name} the figure`.replace("Whole the", "The whole"));
      button.addEventListener("click", act);
    }
    figure.prepend(bar);

    let held = null;
    svg.addEventListener("pointerdown", (event) => {
      if (view.scale > 1) held = { x: event.clientX, y: event.clientY, view: { ...view } };
    });
    svg.addEventListener("pointermove", (event) => {
      if (!held || !event.buttons) return;
      const perPixel = 1 / svg.getScreenCTM().a;
      const [dx, dy] = [(event.clientX - held.x) * perPixel, (event.clientY - held.y) * perPixel];
      set(held.view.x - dx, held.view.y - dy, view.scale);
    });
    window.addEventListener("pointerup", () => (held = null));
  }

  // Browsers print what is folded only where it is open.
  const opened = [];
  window.addEventListener("beforeprint", () => {
    for (const one of document.querySelectorAll("details:not([open], .on-paper-out, .on-paper-summary)")) {
      one.open = true;
      opened.push(one);
    }
  });
  window.addEventListener("afterprint", () => {
    for (const one of opened.splice(0)) one.open = false;
  });
})();
