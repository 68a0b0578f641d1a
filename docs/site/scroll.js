// The keyboard can scroll tables and code that are wider than the page.
document$.subscribe(() => {
  for (const element of document.querySelectorAll(".md-typeset__scrollwrap, pre > code")) {
    if (element.scrollWidth > element.clientWidth) element.tabIndex = 0;
  }
});
