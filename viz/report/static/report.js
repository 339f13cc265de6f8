// Tables that can be sorted and opened, and pixels that tables point at.
(() => {
  'use strict';

  const keyOf = (row, column) => {
    const key = row.cells[column].dataset.key;
    if (key === undefined) return null;
    const number = Number(key);
    return Number.isNaN(number) ? key : number;
  };

  // Unknown values come last, whichever way the table is sorted; equal ones keep their order.
  function compare(a, b, sign) {
    if (a === null || b === null) return (a === null) - (b === null);
    if (typeof a === 'number' && typeof b === 'number') return sign * (a - b);
    return sign * String(a).localeCompare(String(b));
  }

  function cutRows(table) {
    const most = Number(table.dataset.cut || 0);
    if (most) [...table.tBodies[0].rows].forEach((row, i) => row.classList.toggle('rest', i >= most));
  }

  function sortBy(table, column) {
    const heads = [...table.tHead.rows[0].cells];
    const head = heads[column];
    const rows = [...table.tBodies[0].rows];
    const numbers = rows.some((row) => typeof keyOf(row, column) === 'number');
    const before = head.getAttribute('aria-sort');
    const down = before ? before === 'ascending' : numbers;
    heads.forEach((other) => other.removeAttribute('aria-sort'));
    head.setAttribute('aria-sort', down ? 'descending' : 'ascending');
    rows.sort((a, b) => compare(keyOf(a, column), keyOf(b, column), down ? -1 : 1));
    table.tBodies[0].append(...rows);
    cutRows(table);
  }

  document.querySelectorAll('table[data-sortable]').forEach((table) => {
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      head.querySelector('button').addEventListener('click', () => sortBy(table, column));
    });
  });

  document.querySelectorAll('.show-rest').forEach((button) => {
    const table = document.getElementById(button.getAttribute('aria-controls'));
    const more = button.textContent;
    button.addEventListener('click', () => {
      const cut = table.classList.toggle('cut');
      button.setAttribute('aria-expanded', String(!cut));
      button.textContent = cut ? more : button.dataset.less;
    });
  });

  document.querySelectorAll('.show-pixel').forEach((button) => {
    button.addEventListener('click', () => {
      if (!window.pathspaceInspector) return;
      window.pathspaceInspector.show(Number(button.dataset.x), Number(button.dataset.y));
      document.getElementById('image').scrollIntoView();
      document.getElementById('stage').focus({ preventScroll: true });
    });
  });

  // Paper shows what is folded away on a screen.
  const folded = () => [...document.querySelectorAll('details:not([open])')];
  let opened = [];
  window.addEventListener('beforeprint', () => {
    opened = folded();
    opened.forEach((one) => { one.open = true; });
  });
  window.addEventListener('afterprint', () => opened.forEach((one) => { one.open = false; }));
})();
