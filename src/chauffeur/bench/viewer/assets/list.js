/* The rows of one run, or of several beside one another: filtered, sorted, and drawn only as far as they are seen. */
const NO_FILTER = { text: '', ending: '', cause: '', group: '', right: '', differs: '', column: '', value: '', sort: '', down: false };
const MANY_VALUES = 40;
const SPARE_ROWS = 8;

/* One entry a common item: its row and place in every run. */
function entriesOf(runs, matches) {
  return matches.map((places) => {
    const rows = places.map((place, at) => runs[at].rows[place]);
    const found = rows.map((row) => `${row.item} ${row.words} ${row.ending} ${row.group} ${row.causes.join(' ')} ${row.cells.join(' ')}`);
    return { places, rows, text: found.join(' ').toLowerCase() };
  });
}

const differs = {
  outcome: (rows) => rows.some((row) => row.ending !== rows[0].ending || row.wrong !== rows[0].wrong),
  right: (rows) => rows.some((row) => row.wrong !== rows[0].wrong),
  reply: (rows) => rows.some((row) => row.reply !== rows[0].reply),
};

/* A condition on a column: `> 3`, `<= 0.5`, `= text`, or words that are in it. */
function columnTest(wanted) {
  const found = /^\s*(<=|>=|<|>|=|!=)\s*(.*)$/.exec(wanted);
  if (!found) return (value) => String(value ?? '').toLowerCase().includes(wanted.toLowerCase());
  const [, sign, text] = found;
  const number = Number(text);
  if (sign === '=' || sign === '!=') return (value) => (String(value ?? '') === text) === (sign === '=');
  const compare = { '<': (v) => v < number, '>': (v) => v > number, '<=': (v) => v <= number, '>=': (v) => v >= number }[sign];
  return (value) => typeof value === 'number' && compare(value);
}

function kept(runs, entries, filter) {
  const tests = [];
  const words = filter.text.toLowerCase().split(/\s+/).filter(Boolean);
  if (words.length) tests.push((entry) => words.every((word) => entry.text.includes(word)));
  if (filter.ending) tests.push((entry) => entry.rows.some((row) => row.ending === filter.ending));
  if (filter.cause) tests.push((entry) => entry.rows.some((row) => row.causes.includes(filter.cause)));
  if (filter.group) tests.push((entry) => entry.rows[0].group === filter.group);
  if (filter.right) tests.push((entry) => entry.rows.some((row) => row.wrong === (filter.right === 'wrong')));
  if (filter.differs) tests.push((entry) => differs[filter.differs](entry.rows));
  if (filter.column && filter.value !== '') {
    const test = columnTest(filter.value);
    const at = runs.map((run) => run.columns.indexOf(filter.column));
    tests.push((entry) => entry.rows.some((row, run) => test(row.cells[at[run]])));
  }
  const found = entries.filter((entry) => tests.every((test) => test(entry)));
  if (!filter.sort) return filter.down ? found.reverse() : found;
  const at = runs[0].columns.indexOf(filter.sort);
  const own = { ':words': 'words', ':ending': 'ending', ':group': 'group' }[filter.sort];
  const value = (entry) => (own ? entry.rows[0][own] : entry.rows[0].cells[at]);
  const order = (a, b) => {
    const [x, y] = [value(a), value(b)];
    if (x === y) return 0;
    if (x === null || x === undefined) return 1;
    if (y === null || y === undefined) return -1;
    const less = typeof x === 'number' && typeof y === 'number' ? x - y : String(x).localeCompare(String(y), 'en', { numeric: true });
    return filter.down ? -less : less;
  };
  return found.sort(order);
}

const counted = (values) => {
  const counts = new Map();
  for (const value of values) counts.set(value, (counts.get(value) || 0) + 1);
  return [...counts].sort((a, b) => b[1] - a[1]);
};

const choices = (all, values) => [['', all], ...counted(values).map(([value, count]) => [value, `${value || 'none'} (${count.toLocaleString('en')})`])];

/* The bar of filters; `changed` is called after every change of `filter`. */
function filterBar(runs, entries, filter, changed) {
  const set = (name) => (value) => {
    filter[name] = value;
    changed();
  };
  const every = (read) => entries.flatMap((entry) => entry.rows.flatMap(read));
  const search = document.createElement('input');
  search.type = 'search';
  search.id = 'search';
  search.value = filter.text;
  search.placeholder = 'words, ids, values';
  search.addEventListener('input', () => set('text')(search.value));
  const bar = box('form', 'filters', box('label', 'field search', make('span', 'Search'), search));
  bar.addEventListener('submit', (event) => event.preventDefault());
  bar.append(choice('Ending', choices('any', every((row) => row.ending)), filter.ending, set('ending')));
  const causes = every((row) => row.causes);
  if (causes.length) bar.append(choice('Cause', choices('any', causes), filter.cause, set('cause')));
  if (runs[0].group) bar.append(choice(runs[0].group, choices('any', entries.map((entry) => entry.rows[0].group)), filter.group, set('group')));
  const judged = every((row) => (row.wrong === null ? [] : [row.wrong]));
  if (judged.length) {
    const wrong = judged.filter(Boolean).length;
    const rights = [['', 'all'], ['wrong', `not as it should be (${wrong})`], ['right', `as it should be (${judged.length - wrong})`]];
    bar.append(choice('Judged', rights, filter.right, set('right')));
  }
  if (runs.length > 1) {
    const count = (name) => entries.filter((entry) => differs[name](entry.rows)).length;
    const ways = [['', 'or not'], ['right', `right in one only (${count('right')})`], ['outcome', `outcome (${count('outcome')})`], ['reply', `reply (${count('reply')})`]];
    bar.append(choice('Differs', ways, filter.differs, set('differs')));
  }
  const names = runs[0].columns.map((name) => [name, named(name)]);
  const value = make('span', null, 'value-field');
  const setColumn = (name) => {
    filter.column = name;
    filter.value = '';
    drawValue();
    changed();
  };
  const drawValue = () => {
    value.replaceChildren();
    if (!filter.column) return;
    const at = runs[0].columns.indexOf(filter.column);
    const values = entries.map((entry) => entry.rows[0].cells[at]);
    if (new Set(values).size <= MANY_VALUES) {
      const few = counted(values).map(([one, count]) => [`= ${one ?? ''}`, `${one ?? 'none'} (${count})`]);
      value.append(choice('is', [['', 'anything'], ...few], filter.value, set('value')));
      return;
    }
    const input = document.createElement('input');
    input.value = filter.value;
    input.placeholder = '> 3, = x, words';
    input.addEventListener('input', () => set('value')(input.value));
    value.append(box('label', 'field', make('span', 'is'), input));
  };
  bar.append(choice('Column', [['', 'any'], ...names], filter.column, setColumn), value);
  drawValue();
  const sorts = [['', 'order of the run'], [':words', 'words'], [':ending', 'ending'], ...names];
  bar.append(choice('Sort by', sorts, filter.sort, set('sort')));
  const turn = button(filter.down ? '↓' : '↑', 'turn', () => {
    filter.down = !filter.down;
    turn.textContent = filter.down ? '↓' : '↑';
    turn.setAttribute('aria-pressed', String(filter.down));
    changed();
  });
  turn.setAttribute('aria-label', 'Sort downwards');
  turn.setAttribute('aria-pressed', String(filter.down));
  bar.append(turn);
  return bar;
}

function endingMark(row) {
  const mark = make('span', row.ending, `ending ${row.wrong === null ? '' : row.wrong ? 'bad' : 'good'}`);
  if (row.wrong !== null) mark.prepend(make('i', row.wrong ? '✗' : '✓'));
  return mark;
}

/* A list that draws the rows in sight only; `open` is given the number of the chosen one. */
function rowList(runs, filter, open) {
  const list = make('div', null, 'rows');
  const head = make('div', null, 'row-head');
  head.setAttribute('aria-hidden', 'true');
  head.append(make('span', 'What was asked'), box('span', 'endings', ...runs.map((run) => make('span', runs.length > 1 ? run.name : 'Ending'))), make('span', [runs[0].group, 'causes'].filter(Boolean).join(', ')), make('span', '', 'extra'));
  const inner = make('div', null, 'rows-inner');
  list.append(inner);
  list.tabIndex = 0;
  list.id = 'rows';
  list.setAttribute('role', 'listbox');
  list.setAttribute('aria-label', 'Samples');
  let shown = [];
  let active = 0;
  const height = () => parseFloat(getComputedStyle(list).getPropertyValue('--row-px'));
  const extra = () => filter.column || (filter.sort && !filter.sort.startsWith(':') ? filter.sort : '');

  function rowNode(entry, place) {
    const [first] = entry.rows;
    const node = make('div', null, `row${place === active ? ' active' : ''}`);
    node.id = `row-${place}`;
    node.setAttribute('role', 'option');
    node.setAttribute('aria-selected', String(place === active));
    node.setAttribute('aria-setsize', String(shown.length));
    node.setAttribute('aria-posinset', String(place + 1));
    node.style.transform = `translateY(${place * height()}px)`;
    const words = make('span', first.words, 'words');
    words.dir = 'auto';
    const about = [first.group === first.ending ? '' : first.group, ...first.causes].filter(Boolean).join(' · ');
    node.append(words, box('span', 'endings', ...entry.rows.map(endingMark)), make('span', about, 'about'));
    if (extra()) {
      const at = runs.map((run) => run.columns.indexOf(extra()));
      const values = entry.rows.map((row, run) => row.cells[at[run]]).map((one) => (typeof one === 'number' ? Number(one.toFixed(4)) : one ?? 'none'));
      node.append(make('span', values.join(' | '), 'extra'));
    }
    node.addEventListener('click', () => open(place));
    return node;
  }

  function draw() {
    const each = height();
    const first = Math.max(0, Math.floor(list.scrollTop / each) - SPARE_ROWS);
    const last = Math.min(shown.length, Math.ceil((list.scrollTop + list.clientHeight) / each) + SPARE_ROWS);
    for (const node of [list, head]) {
      node.style.setProperty('--runs', runs.length);
      node.classList.toggle('more', Boolean(extra()));
    }
    head.style.paddingRight = `calc(.75rem + ${list.offsetWidth - list.clientWidth - 1}px)`;
    head.lastChild.textContent = extra() ? named(extra()) : '';
    inner.style.height = `${shown.length * each}px`;
    inner.replaceChildren(...shown.slice(first, last).map((entry, at) => rowNode(entry, first + at)));
    if (shown.length) list.setAttribute('aria-activedescendant', `row-${active}`);
    else list.removeAttribute('aria-activedescendant');
    if (!shown.length) inner.append(make('p', 'No sample is like that.', 'empty'));
  }

  function move(to) {
    active = Math.min(Math.max(to, 0), Math.max(shown.length - 1, 0));
    const top = active * height();
    if (top < list.scrollTop) list.scrollTop = top;
    else if (top + height() > list.scrollTop + list.clientHeight) list.scrollTop = top + height() - list.clientHeight;
    draw();
  }

  const page = () => Math.max(1, Math.floor(list.clientHeight / height()) - 1);
  const keys = {
    ArrowDown: () => move(active + 1), j: () => move(active + 1), ArrowUp: () => move(active - 1), k: () => move(active - 1),
    PageDown: () => move(active + page()), PageUp: () => move(active - page()), Home: () => move(0), End: () => move(shown.length - 1),
    Enter: () => shown.length && open(active),
  };
  list.addEventListener('keydown', (event) => {
    if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    keys[event.key]();
  });
  list.addEventListener('scroll', () => requestAnimationFrame(draw));
  new ResizeObserver(() => draw()).observe(list);
  return { node: list, head, show: (entries, at) => { shown = entries; move(at); } };
}
