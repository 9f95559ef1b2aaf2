/* Speed and gap over the same time axis as the time line. */
const FAR_M = 120;
const SVG = 'http://www.w3.org/2000/svg';

function svg(tag, attributes, text) {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  if (text !== undefined) node.textContent = text;
  return node;
}

function niceTicks(low, high, wanted) {
  const raw = (high - low) / wanted;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw);
  const ticks = [];
  for (let v = Math.ceil(low / step - 1e-9) * step; v <= high + 1e-9; v += step) ticks.push(v);
  return ticks;
}

/* `series` is [{name, className, values, broken}]: a line breaks where `broken` changes value. */
function makeChart({ element, legend, series, low, high, unit, total, onSeek, timeAxis, bands = [] }) {
  legend.append(make('span', unit, 'unit'));
  for (const item of series) {
    const part = make('span');
    part.append(make('i', null, item.className), make('span', item.name));
    legend.append(part);
  }
  if (bands.length) {
    const part = make('span');
    part.append(make('i', null, 'c-shield'), make('span', 'Shield acts'));
    legend.append(part);
  }
  let cursor;
  let dot;
  let place;
  const seek = (event) => {
    const box = element.getBoundingClientRect();
    onSeek(Math.min(Math.max((event.clientX - box.left - place.left) / place.width, 0), 1) * total);
  };
  element.addEventListener('pointerdown', (event) => {
    element.setPointerCapture(event.pointerId);
    seek(event);
  });
  element.addEventListener('pointermove', (event) => { if (event.buttons & 1) seek(event); });

  function path(values, broken) {
    let words = '';
    let pen = false;
    values.forEach((value, index) => {
      if (broken && index && broken[index] !== broken[index - 1]) pen = false;
      if (value === null || value > high) { pen = false; return; }
      words += `${pen ? 'L' : 'M'}${place.x(drive.time[index]).toFixed(1)} ${place.y(value).toFixed(1)}`;
      pen = true;
    });
    return words;
  }

  function resize() {
    const width = element.clientWidth;
    const height = element.clientHeight;
    const gutter = parseFloat(getComputedStyle(document.querySelector('.track')).marginLeft);
    const bottom = timeAxis ? 20 : 8;
    place = { left: gutter, width: width - 2 * gutter, x: (t) => gutter + (t / total) * (width - 2 * gutter), y: (v) => height - bottom - ((v - low) / (high - low)) * (height - bottom - 10) };
    element.setAttribute('viewBox', `0 0 ${width} ${height}`);
    element.replaceChildren();
    for (const band of bands) {
      const from = place.x(band.t);
      element.append(svg('rect', { class: 'c-shield', x: from, y: 4, width: Math.max(place.x(Math.min(band.end, total)) - from, 2), height: height - bottom - 4 }));
    }
    for (const tick of niceTicks(low, high, height > 110 ? 4 : 3)) {
      const y = place.y(tick);
      element.append(svg('line', { class: 'grid', x1: gutter, x2: width - gutter, y1: y, y2: y }));
      element.append(svg('text', { x: gutter - 8, y: y + 4, 'text-anchor': 'end' }, `${+tick.toFixed(2)}`));
    }
    if (timeAxis) {
      for (const tick of niceTicks(0, total, Math.max(3, width / 110))) {
        element.append(svg('text', { x: place.x(tick), y: height - 4, 'text-anchor': 'middle' }, `${+tick.toFixed(1)} s`));
      }
    }
    for (const item of series) element.append(svg('path', { class: `line ${item.className}`, d: path(item.values, item.broken) }));
    cursor = svg('line', { class: 'cursor', y1: 4, y2: height - bottom });
    dot = svg('circle', { class: 'dot', r: 4.5 });
    element.append(cursor, dot);
  }

  function move(time, index) {
    const x = place.x(time);
    cursor.setAttribute('x1', x);
    cursor.setAttribute('x2', x);
    const value = series[0].values[index];
    dot.setAttribute('visibility', value === null || value > high ? 'hidden' : 'visible');
    if (value !== null) {
      dot.setAttribute('cx', x);
      dot.setAttribute('cy', place.y(Math.min(value, high)));
    }
  }
  return { resize, move };
}

function makeCharts(total, onSeek) {
  const inPace = (values) => values.map((v) => (v === null ? null : v * trip.pace.of));
  const known = inPace([...drive.speed, ...drive.target, ...drive.limit]).filter((v) => v !== null);
  const top = Math.max(...known);
  const low = Math.max(0, Math.floor(Math.min(...known) - Math.max(1, top * 0.05)));
  const limits = drive.limit.some((v) => v !== null);
  const gaps = drive.gap.filter((v) => v !== null && v <= FAR_M);
  const charts = [makeChart({
    element: $('speed-chart'), legend: $('speed-legend'), unit: trip.pace.unit, total, onSeek, timeAxis: !gaps.length,
    low, high: Math.ceil(top + Math.max(1, top * 0.04)),
    bands: trip.shield ? trip.shield.stretches : [],
    series: [
      { name: 'Speed', className: 'c-speed', values: inPace(drive.speed) },
      { name: 'Target speed', className: 'c-target', values: inPace(drive.target) },
      ...(limits ? [{ name: 'Speed limit', className: 'c-limit', values: inPace(drive.limit) }] : []),
    ],
  })];
  if (gaps.length) {
    $('gap-chart').classList.add('low');
    charts.push(makeChart({
      element: $('gap-chart'), legend: $('gap-legend'), unit: 'm', total, onSeek, timeAxis: true,
      low: 0, high: Math.ceil(Math.max(...gaps) / 10) * 10,
      series: [{ name: 'Gap to the vehicle ahead, centre to centre', className: 'c-gap', values: drive.gap, broken: drive.lead }],
    }));
  } else {
    $('gap-chart').parentElement.hidden = true;
  }
  return charts;
}
