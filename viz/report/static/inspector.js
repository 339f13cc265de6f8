// The pixel inspector: one canvas, a view that zooms and pans, a cursor, and what is known of the pixel under it.
(() => {
  'use strict';
  const data = window.pathspacePixels;
  const stage = document.getElementById('stage');
  if (!data || !stage) return;

  const NO_CLASS = 255;
  const LUMINANCE = [0.2126, 0.7152, 0.0722];
  const MOST_ZOOM = 64; // screen pixels of one pixel
  const canvas = document.getElementById('canvas');
  const context = canvas.getContext('2d');
  const element = (id) => document.getElementById(id);

  // --- what is known ------------------------------------------------------------------------------------------------

  function unpack(text) {
    const bytes = atob(text);
    const found = new Uint8Array(bytes.length);
    for (let i = 0; i < bytes.length; i += 1) found[i] = bytes.charCodeAt(i);
    return found.buffer;
  }

  function littleEndian(buffer, size, read) {
    const view = new DataView(buffer);
    return (i) => view[read](i * size, true);
  }

  const radiance = littleEndian(unpack(data.radiance), 4, 'getFloat32');
  const classes = data.classes ? new Uint8Array(unpack(data.classes)) : null;
  const parts = data.parts ? littleEndian(unpack(data.parts), 2, 'getUint16') : null;
  const cellOf = (x, y) => Math.floor(y / data.block) * data.columns + Math.floor(x / data.block);

  function lightAt(x, y) {
    const cell = cellOf(x, y);
    const rgb = [0, 1, 2].map((channel) => radiance(3 * cell + channel));
    const shares = [];
    let other = 0;
    if (classes) {
      for (let slot = 0; slot < data.slots; slot += 1) {
        const number = classes[cell * data.slots + slot];
        if (number !== NO_CLASS) shares.push([number, parts(cell * (data.slots + 1) + slot) / data.whole]);
      }
      other = parts(cell * (data.slots + 1) + data.slots) / data.whole;
    }
    return { rgb, luminance: rgb.reduce((sum, value, i) => sum + value * LUMINANCE[i], 0), shares, other };
  }

  // --- words and numbers --------------------------------------------------------------------------------------------

  const number = (value) => (Number.isFinite(value) ? String(Number(value.toPrecision(4))) : String(value));
  const percent = (share) => `${(100 * share).toFixed(2)} %`;

  function spoken(x, y, light) {
    const place = data.block === 1 ? `Pixel (${x}, ${y})` : `Block around (${x}, ${y})`;
    const parts = light.shares.map(([name, share]) => `${data.names[name].description} ${percent(share)}`);
    if (light.other > 0) parts.push(`other classes ${percent(light.other)}`);
    const made = parts.length ? `: ${parts.join('; ')}` : classes ? ': no light' : '';
    return `${place}: radiance ${light.rgb.map(number).join(', ')}, luminance ${number(light.luminance)}${made}.`;
  }

  function shareRow(color, words, expression, share) {
    const row = document.createElement('tr');
    const name = document.createElement('td');
    const swatch = document.createElement('span');
    swatch.className = 'swatch';
    swatch.style.background = color;
    name.append(swatch, words);
    if (expression) {
      const code = document.createElement('code');
      code.textContent = expression;
      name.append(code);
    }
    const amount = document.createElement('td');
    amount.className = 'number';
    amount.textContent = percent(share);
    row.append(name, amount);
    return row;
  }

  const OTHER_COLOR = '#9b9b9b';
  let speaking = 0;

  function tell() {
    if (!cursor) return;
    const { x, y } = cursor;
    const light = lightAt(x, y);
    element('figure-place').textContent = data.block === 1 ? `${x}, ${y}` : `${x}, ${y} (block of ${data.block} × ${data.block})`;
    element('figure-radiance').textContent = light.rgb.map(number).join('  ');
    element('figure-luminance').textContent = number(light.luminance);
    const listed = light.shares.map(([name, share]) => [data.names[name].color, data.names[name].description, data.names[name].expression, share]);
    if (light.other > 0) listed.push([OTHER_COLOR, 'other classes', '', light.other]);
    element('stack').replaceChildren(...listed.map(([color, , , share]) => {
      const piece = document.createElement('span');
      piece.style.background = color;
      piece.style.flexGrow = share;
      return piece;
    }));
    const rows = listed.map((one) => shareRow(...one));
    element('shares').replaceChildren(...(rows.length ? rows : [emptyRow(classes ? 'no light' : 'not recorded')]));
    element('at-x').value = x;
    element('at-y').value = y;
    // What is read aloud waits until the cursor rests.
    clearTimeout(speaking);
    speaking = setTimeout(() => { element('readout').textContent = spoken(x, y, light); }, 60);
  }

  function emptyRow(words) {
    const row = document.createElement('tr');
    const cell = document.createElement('td');
    cell.colSpan = 2;
    cell.className = 'faint';
    cell.textContent = words;
    row.append(cell);
    return row;
  }

  // --- what is shown ------------------------------------------------------------------------------------------------

  const pictures = data.pictures.map(({ label, file }) => {
    const image = new Image();
    image.addEventListener('load', draw);
    image.src = file;
    return { label, image };
  });

  function cells(paint) {
    const made = document.createElement('canvas');
    made.width = data.columns;
    made.height = data.rows;
    const pixels = made.getContext('2d').createImageData(data.columns, data.rows);
    for (let cell = 0; cell < data.columns * data.rows; cell += 1) {
      const [r, g, b] = paint(cell);
      pixels.data.set([r, g, b, 255], 4 * cell);
    }
    made.getContext('2d').putImageData(pixels, 0, 0);
    return made;
  }

  const rgbOf = (color) => [1, 3, 5].map((i) => parseInt(color.slice(i, i + 2), 16));

  function largestClasses() {
    const colors = data.names.map((name) => rgbOf(name.color));
    return cells((cell) => {
      const first = classes[cell * data.slots];
      return first === NO_CLASS ? [24, 24, 24] : colors[first];
    });
  }

  function shareOf(wanted) {
    return cells((cell) => {
      for (let slot = 0; slot < data.slots; slot += 1) {
        if (classes[cell * data.slots + slot] === wanted) {
          const level = Math.round(255 * Math.sqrt(parts(cell * (data.slots + 1) + slot) / data.whole));
          return [level, level, level];
        }
      }
      return [0, 0, 0];
    });
  }

  let shown = () => pictures.length && pictures[0].image;

  function choices() {
    const select = element('shown');
    const group = (label) => {
      const made = document.createElement('optgroup');
      made.label = label;
      select.append(made);
      return made;
    };
    const option = (parent, value, text) => {
      const made = document.createElement('option');
      made.value = value;
      made.textContent = text;
      parent.append(made);
    };
    const first = group('images');
    pictures.forEach(({ label }, i) => option(first, `picture ${i}`, label));
    if (classes) {
      const second = group('classes of paths');
      option(second, 'largest', 'largest class of each pixel');
      data.names.slice(0, 24).forEach((name, i) => option(second, `share ${i}`, `share of: ${name.description}`));
    }
    select.addEventListener('change', () => {
      const [kind, which] = select.value.split(' ');
      const made = kind === 'picture' ? null : kind === 'largest' ? largestClasses() : shareOf(Number(which));
      shown = made ? () => made : () => pictures[Number(which)].image;
      draw();
    });
  }

  // --- the view -----------------------------------------------------------------------------------------------------

  let cursor = null;
  let held = false;
  const view = { zoom: 1, left: 0, top: 0 }; // screen pixels of one pixel; the image's left and top, in screen pixels

  const fitted = () => Math.min(stage.clientWidth / data.width, stage.clientHeight / data.height);

  function clampView() {
    view.zoom = Math.min(MOST_ZOOM, Math.max(fitted(), view.zoom));
    [['left', stage.clientWidth, data.width], ['top', stage.clientHeight, data.height]].forEach(([side, room, size]) => {
      const whole = size * view.zoom;
      view[side] = whole <= room ? (room - whole) / 2 : Math.min(0, Math.max(room - whole, view[side]));
    });
  }

  function fit() {
    view.zoom = 0;
    clampView();
    draw();
  }

  function zoomBy(factor, x = stage.clientWidth / 2, y = stage.clientHeight / 2) {
    const before = view.zoom;
    view.zoom = Math.min(MOST_ZOOM, Math.max(fitted(), before * factor));
    view.left = x - (x - view.left) * (view.zoom / before);
    view.top = y - (y - view.top) * (view.zoom / before);
    clampView();
    draw();
    return view.zoom !== before;
  }

  function zoomAtCursor(factor) {
    if (!cursor) return zoomBy(factor);
    return zoomBy(factor, view.left + (cursor.x + 0.5) * view.zoom, view.top + (cursor.y + 0.5) * view.zoom);
  }

  function draw() {
    const scale = window.devicePixelRatio || 1;
    const width = Math.max(1, Math.round(stage.clientWidth * scale));
    const height = Math.max(1, Math.round(stage.clientHeight * scale));
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.clearRect(0, 0, stage.clientWidth, stage.clientHeight);
    context.imageSmoothingEnabled = view.zoom < 1;
    const picture = shown();
    if (picture && (picture.width || picture.naturalWidth)) {
      context.drawImage(picture, view.left, view.top, data.width * view.zoom, data.height * view.zoom);
    }
    if (cursor) drawCursor();
    element('zoom').textContent = `${Math.round(100 * view.zoom)} %`;
  }

  function drawCursor() {
    const block = data.block;
    const x = view.left + Math.floor(cursor.x / block) * block * view.zoom;
    const y = view.top + Math.floor(cursor.y / block) * block * view.zoom;
    const side = Math.max(block * view.zoom, 5);
    const off = (block * view.zoom - side) / 2;
    context.lineWidth = 3;
    context.strokeStyle = 'rgba(0, 0, 0, 0.75)';
    context.strokeRect(x + off - 1, y + off - 1, side + 2, side + 2);
    context.lineWidth = 1.5;
    context.strokeStyle = held ? '#ffd166' : '#ffffff';
    context.strokeRect(x + off - 1, y + off - 1, side + 2, side + 2);
  }

  function moveTo(x, y) {
    cursor = {
      x: Math.min(data.width - 1, Math.max(0, Math.round(x) || 0)),
      y: Math.min(data.height - 1, Math.max(0, Math.round(y) || 0)),
    };
    tell();
    draw();
  }

  function reveal() {
    const x = view.left + (cursor.x + 0.5) * view.zoom;
    const y = view.top + (cursor.y + 0.5) * view.zoom;
    if (x < 8 || x > stage.clientWidth - 8) view.left += stage.clientWidth / 2 - x;
    if (y < 8 || y > stage.clientHeight - 8) view.top += stage.clientHeight / 2 - y;
    clampView();
    draw();
  }

  function show(x, y) {
    held = true;
    moveTo(x, y);
    if (view.zoom < 8) zoomAtCursor(8 / view.zoom);
    view.left = stage.clientWidth / 2 - (cursor.x + 0.5) * view.zoom;
    view.top = stage.clientHeight / 2 - (cursor.y + 0.5) * view.zoom;
    clampView();
    draw();
  }

  // --- hands --------------------------------------------------------------------------------------------------------

  function placeOf(event) {
    const box = canvas.getBoundingClientRect();
    const x = Math.floor((event.clientX - box.left - view.left) / view.zoom);
    const y = Math.floor((event.clientY - box.top - view.top) / view.zoom);
    return x >= 0 && y >= 0 && x < data.width && y < data.height ? { x, y } : null;
  }

  const fingers = new Map();
  let dragged = 0;

  stage.addEventListener('pointerdown', (event) => {
    fingers.set(event.pointerId, event);
    dragged = 0;
    stage.setPointerCapture(event.pointerId);
  });
  stage.addEventListener('pointermove', (event) => {
    const before = fingers.get(event.pointerId);
    if (before && fingers.size === 2) {
      const [other] = [...fingers.values()].filter((one) => one.pointerId !== event.pointerId);
      const apart = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY) || 1;
      const box = canvas.getBoundingClientRect();
      zoomBy(apart(event) / apart(before), (event.clientX + other.clientX) / 2 - box.left, (event.clientY + other.clientY) / 2 - box.top);
      dragged = 100;
    } else if (before) {
      view.left += event.clientX - before.clientX;
      view.top += event.clientY - before.clientY;
      dragged += Math.abs(event.clientX - before.clientX) + Math.abs(event.clientY - before.clientY);
      clampView();
      draw();
    } else if (!held) {
      const place = placeOf(event);
      if (place) moveTo(place.x, place.y);
    }
    if (before) fingers.set(event.pointerId, event);
  });
  const lift = (event) => {
    const known = fingers.delete(event.pointerId);
    const place = placeOf(event);
    if (known && event.type === 'pointerup' && dragged < 4 && place) {
      held = !(held && cursor && cursor.x === place.x && cursor.y === place.y);
      moveTo(place.x, place.y);
    }
  };
  stage.addEventListener('pointerup', lift);
  stage.addEventListener('pointercancel', lift);
  stage.addEventListener('wheel', (event) => {
    const box = canvas.getBoundingClientRect();
    // Where there is nothing left to zoom out of, the page scrolls on.
    if (zoomBy(1.0015 ** -event.deltaY, event.clientX - box.left, event.clientY - box.top)) event.preventDefault();
  }, { passive: false });
  stage.addEventListener('dblclick', (event) => event.preventDefault());

  const STEPS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

  stage.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const step = STEPS[event.key];
    if (step) {
      const far = event.shiftKey ? 10 : 1;
      const from = cursor || { x: Math.floor(data.width / 2), y: Math.floor(data.height / 2) };
      held = true;
      moveTo(from.x + far * step[0], from.y + far * step[1]);
      reveal();
    } else if (event.key === '+' || event.key === '=') zoomAtCursor(1.5);
    else if (event.key === '-' || event.key === '_') zoomAtCursor(1 / 1.5);
    else if (event.key === '0') fit();
    else if (event.key === 'Escape') {
      held = false;
      draw();
    } else return;
    event.preventDefault();
  });

  element('inspector').addEventListener('click', (event) => {
    const act = event.target.dataset && event.target.dataset.do;
    if (act === 'in') zoomAtCursor(1.5);
    else if (act === 'out') zoomAtCursor(1 / 1.5);
    else if (act === 'fit') fit();
  });
  ['at-x', 'at-y'].forEach((id) => element(id).addEventListener('change', () => {
    held = true;
    moveTo(Number(element('at-x').value), Number(element('at-y').value));
    reveal();
  }));

  choices();
  new ResizeObserver(() => {
    const whole = view.zoom <= fitted() * 1.001 || view.zoom === 1;
    if (whole) view.zoom = 0;
    clampView();
    draw();
  }).observe(stage);
  fit();
  window.pathspaceInspector = { show };
})();
