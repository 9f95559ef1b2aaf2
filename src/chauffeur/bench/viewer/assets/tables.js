/* Tables of results: figures as text, their intervals as bars, and the plot of the first. */
const ARROWS = { higher: ['↑', 'higher is better'], lower: ['↓', 'lower is better'] };

function better(direction) {
  if (!direction) return null;
  const [arrow, words] = ARROWS[direction];
  const mark = make('span', arrow, 'better');
  mark.title = words;
  mark.append(make('span', ` ${words}`, 'hidden'));
  return mark;
}

function bar(at) {
  const path = (className, d) => drawn('path', { class: className, d });
  const picture = drawn('svg', { class: 'bar', viewBox: '0 0 100 8', preserveAspectRatio: 'none', 'aria-hidden': 'true' });
  picture.append(path('axis', 'M0 4H100'));
  if (at.zero !== null) picture.append(path('zero', `M${at.zero} 0V8`));
  if (at.low !== null && at.high !== null) picture.append(path('range', `M${at.low} 4H${Math.max(at.high, at.low + 0.5)}`));
  picture.append(path('value', `M${Math.min(Math.max(at.value, 1), 99)} 0V8`));
  return picture;
}

function cellOf(cell, measure, form) {
  const node = make('td', null, form && !cell.text ? 'none' : '');
  node.dataset.head = measure.head;
  if (cell.text === 'n/a') node.append(make('span', 'n/a', 'na'));
  else node.append(make('b', cell.text));
  if (cell.ends) node.append(make('small', cell.ends));
  if (cell.bar) node.append(bar(cell.bar));
  return node;
}

function rowOf(table, entry) {
  const name = make('th', entry.name);
  name.scope = 'row';
  for (const label of labels(entry.labels)) name.append(' ', label);
  const items = make('td', null, entry.items ? '' : 'none');
  items.dataset.head = table.heads[1];
  items.append(make('b', entry.items));
  return box('tr', null, name, items, ...entry.cells.map((cell, place) => cellOf(cell, table.measures[place], entry.form)));
}

function grid(table, lines, grouped) {
  const heads = table.heads.map((text) => make('th', text));
  for (const measure of table.measures) {
    const head = make('th', measure.title);
    if (measure.unit) head.append(' ', make('small', measure.unit));
    head.append(...[better(measure.better)].filter(Boolean));
    heads.push(head);
  }
  for (const head of heads) head.scope = 'col';
  const node = box('table', null, make('caption', table.title, 'hidden'), box('thead', null, box('tr', null, ...heads)));
  let body = null;
  let group = null;
  for (const entry of lines) {
    if (body === null || (grouped && entry.group !== group)) {
      body = make('tbody', null, entry.published ? 'published' : '');
      node.append(body);
      group = entry.group;
      if (grouped && group) {
        const head = make('th', group);
        head.colSpan = table.measures.length + 2;
        head.scope = 'rowgroup';
        body.append(box('tr', 'group', head));
      }
    }
    body.append(rowOf(table, entry));
  }
  const scroll = box('div', 'scroll', node);
  scroll.tabIndex = 0;
  scroll.setAttribute('role', 'region');
  scroll.setAttribute('aria-label', table.title);
  return scroll;
}

function plot(found) {
  const at = (value) => `${value}%`;
  const rows = found.lines.map((entry) => {
    const picture = drawn('svg', { 'aria-hidden': 'true' });
    for (const mark of found.marks) picture.append(drawn('line', { class: 'grid', x1: at(mark.at), x2: at(mark.at), y1: 0, y2: '100%' }));
    const { low, high, value } = entry.bar;
    if (low !== null && high !== null) picture.append(drawn('line', { class: 'range', x1: at(low), x2: at(high), y1: '50%', y2: '50%' }));
    picture.append(drawn('circle', { class: 'value', cx: at(value), cy: '50%', r: 5 }));
    return box('li', entry.published ? 'printed' : 'own', make('span', entry.name, 'who'), picture, make('b', entry.text));
  });
  const axis = drawn('svg', {});
  for (const mark of found.marks) {
    const text = drawn('text', { x: at(mark.at), y: '1em', 'text-anchor': 'middle' });
    text.textContent = mark.text;
    axis.append(text);
  }
  const last = box('li', 'axis', axis);
  last.setAttribute('aria-hidden', 'true');
  return box('figure', 'plot', make('figcaption', found.caption), box('ol', null, ...rows, last));
}

function legend(table) {
  const list = make('dl');
  for (const measure of table.measures.filter((one) => one.meaning)) {
    const term = make('dt', measure.title);
    if (measure.unit) term.append(' ', make('small', measure.unit));
    const words = ARROWS[measure.better];
    list.append(term, make('dd', `${measure.meaning}${words ? ` ${words[1][0].toUpperCase()}${words[1].slice(1)}.` : ''}`));
  }
  return list.children.length ? box('details', 'legend', make('summary', 'What the columns mean'), list) : null;
}

/* What is printed elsewhere is for looking up: unfolded, it would bury the lines that the table is about. */
function tableCard(table, simulated) {
  const own = table.lines.filter((entry) => !entry.published);
  const printed = table.lines.filter((entry) => entry.published);
  const heading = make('h2', table.title);
  if (simulated) heading.append(' ', make('span', 'simulated drives', 'pill'));
  return box(
    'section', 'card',
    heading,
    table.lead ? make('p', table.lead, 'lead-words') : null,
    grid(table, own, true),
    table.plot ? plot(table.plot) : null,
    printed.length ? folded(printed[0].group, grid(table, printed, false)) : null,
    ...table.notes.map((note) => make('p', note, 'note')),
    legend(table),
  );
}
