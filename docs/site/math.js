// Typesets the formulas of a page, also after a change of page without loading.
document$.subscribe(() => {
  for (const element of document.querySelectorAll(".arithmatex")) {
    const text = element.textContent.trim();
    const display = text.startsWith("\\[");
    katex.render(text.slice(2, -2), element, { displayMode: display, throwOnError: true });
    // The keyboard can scroll wide formulas.
    if (display) element.querySelector(".katex-display").tabIndex = 0;
  }
});
