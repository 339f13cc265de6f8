// Views of subpixels begin where there is most to see, move together, and can be dragged.
(() => {
  'use strict';

  const views = [...document.querySelectorAll('.closely')];
  const room = (view) => [view.scrollWidth - view.clientWidth, view.scrollHeight - view.clientHeight];
  const start = document.getElementById('pictures')?.dataset;
  let leader = null;

  function follow(view) {
    if (leader && leader !== view) return;
    const [across, down] = room(view);
    const x = across > 0 ? view.scrollLeft / across : 0;
    const y = down > 0 ? view.scrollTop / down : 0;
    views.filter((other) => other !== view).forEach((other) => {
      const [wide, tall] = room(other);
      other.scrollTo(x * wide, y * tall);
    });
  }

  function drag(view) {
    let from = null;
    view.addEventListener('pointerdown', (event) => {
      if (event.pointerType !== 'mouse' || event.button !== 0) return;
      from = [event.clientX + view.scrollLeft, event.clientY + view.scrollTop];
      view.setPointerCapture(event.pointerId);
      event.preventDefault();
      view.focus({ preventScroll: true });
    });
    view.addEventListener('pointermove', (event) => {
      if (from) view.scrollTo(from[0] - event.clientX, from[1] - event.clientY);
    });
    ['pointerup', 'pointercancel'].forEach((kind) => view.addEventListener(kind, () => { from = null; }));
  }

  views.forEach((view) => {
    view.scrollTo(start.x - view.clientWidth / 2, start.y - view.clientHeight / 2);
    ['pointerenter', 'pointerdown', 'focus', 'touchstart'].forEach((kind) => view.addEventListener(kind, () => { leader = view; }, { passive: true }));
    view.addEventListener('scroll', () => follow(view), { passive: true });
    drag(view);
  });
})();
