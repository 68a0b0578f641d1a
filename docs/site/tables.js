// The keyboard can scroll tables that are wider than the page.
document$.subscribe(() => {
  for (const element of document.querySelectorAll(".md-typeset__scrollwrap")) {
    if (element.scrollWidth > element.clientWidth) element.tabIndex = 0;
  }
});
