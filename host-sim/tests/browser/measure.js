// Measures a report inside a frame and tells the page around it: how much wider than its window the
// page is, which labels of a figure lie on each other or are cut off, which texts are hard to read, and which names
// of rows are gone when a figure is scrolled sideways.
"use strict";
addEventListener("load", () => {
  const channels = colour => (colour.match(/[\d.]+/g) || [0, 0, 0, 0]).map(Number);
  const luminance = colour => {
    const linear = part => part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4;
    const [r, g, b] = channels(colour).map(channel => linear(channel / 255));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const contrast = (one, other) => {
    const [a, b] = [luminance(one), luminance(other)];
    return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  };
  const behind = element => {
    for (let at = element; at; at = at.parentElement) {
      const colour = getComputedStyle(at).backgroundColor;
      const [, , , opacity = 1] = channels(colour);
      if (opacity > 0.99) return colour;
    }
    return "rgb(255, 255, 255)";
  };
  const hard = new Set();
  const judge = (name, colour, paper) => {
    const told = contrast(colour, paper);
    if (told < 4.5) hard.add(`${name}: ${colour} on ${paper}, ${told.toFixed(2)}`);
  };
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const text = walker.currentNode.textContent.trim();
    const element = walker.currentNode.parentElement;
    if (!text || element.closest("svg, script, style, option") || !element.getClientRects().length) continue;
    judge(element.tagName + " " + text.slice(0, 20), getComputedStyle(element).color, behind(element));
  }

  const overlaps = [], cut = [];
  let labels = 0;
  for (const svg of document.querySelectorAll("figure > .scroll > svg")) {
    const name = svg.querySelector("title").textContent;
    const paper = getComputedStyle(svg.querySelector("rect")).fill;
    const page = svg.getBoundingClientRect();
    const boxes = [...svg.querySelectorAll("text")].map(text => {
      judge(name + " " + text.textContent.slice(0, 20), getComputedStyle(text).fill, paper);
      const { left, right, top, bottom } = text.getBoundingClientRect();
      // A line's box is higher than its letters.
      const spare = 0.14 * Math.min(right - left, bottom - top);
      return { text: text.textContent, left: left + spare, right: right - spare, top: top + spare, bottom: bottom - spare };
    });
    labels += boxes.length;
    boxes.forEach((a, index) => {
      if (a.left < page.left - 1 || a.right > page.right + 1 || a.top < page.top - 1 || a.bottom > page.bottom + 1) {
        cut.push(`${name}: "${a.text}"`);
      }
      for (const b of boxes.slice(index + 1)) {
        if (a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom) overlaps.push(`${name}: "${a.text}" on "${b.text}"`);
      }
    });
  }
  const gone = [];
  let names = 0;
  for (const box of document.querySelectorAll("figure .scroll")) {
    const rows = [...box.querySelectorAll("text[text-anchor=end]")].filter(text => text.getAttribute("x") < 150 && /^[a-z]/i.test(text.textContent));
    box.scrollLeft = 200;
    if (box.scrollLeft === 0) continue;
    box.dispatchEvent(new Event("scroll"));
    names += rows.length;
    for (const row of rows) {
      if (row.getBoundingClientRect().left < box.getBoundingClientRect().left - 1) gone.push(`${box.getAttribute("aria-label")}: "${row.textContent}"`);
    }
  }
  const root = document.scrollingElement;
  const faults = { overlaps, cut, hard: [...hard], gone };
  parent.postMessage({ width: innerWidth, wider: root.scrollWidth - root.clientWidth, labels, names, ...faults }, "*");
});
