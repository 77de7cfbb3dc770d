// Sorting by a click or key on a column's head, and every table open on paper.
"use strict";
(() => {
  const number = (text) => {
    const plain = text.replace(/\u2212/g, "-").replace(/[\u2007\u2008\u00a0]/g, "");
    const found = plain.match(/^[^\d-]*(-?\d+(?:\.\d+)?)(?:×10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?/);
    if (!found) return null;
    const power = [...(found[2] ?? "")].map((digit) => (digit === "⁻" ? "-" : "⁰¹²³⁴⁵⁶⁷⁸⁹".indexOf(digit))).join("");
    return Number(found[1]) * 10 ** Number(power || 0);
  };

  function order(body, column, numeric, descending) {
    const key = (row) => {
      const text = row.cells[column]?.textContent.trim() ?? "";
      return numeric ? number(text) : text;
    };
    const missing = (value) => value === null || value === "" || value === "–";
    body.sort((a, b) => {
      const [x, y] = [key(a), key(b)];
      if (missing(x) || missing(y)) return missing(x) - missing(y);
      const less = numeric ? x - y : x.localeCompare(y, "en", { numeric: true });
      return descending ? -less : less;
    });
    return body;
  }

  for (const table of document.querySelectorAll("table")) {
    const rows = [...table.tBodies[0].rows];
    // Where a row continues the one above, order has a meaning.
    if (rows.length < 3 || rows.some((row) => row.cells[0].textContent.trim() === "")) continue;
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const before = head.getAttribute("aria-sort");
        heads.forEach((other) => other.removeAttribute("aria-sort"));
        const next = { null: "ascending", ascending: "descending", descending: null }[before];
        if (next) head.setAttribute("aria-sort", next);
        const numeric = head.classList.contains("number");
        table.tBodies[0].append(...(next ? order([...rows], column, numeric, next === "descending") : rows));
      });
    });
  }

  const folded = () => document.querySelectorAll("details:not([open])");
  let opened = [];
  addEventListener("beforeprint", () => {
    opened = [...folded()];
    opened.forEach((one) => (one.open = true));
  });
  addEventListener("afterprint", () => opened.forEach((one) => (one.open = false)));
})();
