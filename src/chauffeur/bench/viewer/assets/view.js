/* The views and the way between them: the list of all, runs, a sample, a trip. */
const LIVE_MS = 2000;
const TABLES_MS = 15000;
const STATES = { running: 'running', unfinished: 'unfinished', unreadable: 'cannot be read', finished: 'finished' };
const memory = { index: null, filters: new Map(), views: new Map(), chosen: new Set(), indexText: '', sort: 'when', tab: 'results' };
let turn = 0;
let refresh = null;

function crumbs(...parts) {
  $('crumbs').replaceChildren(...parts.map(([text, href], place) => {
    const item = box('li', null, href ? link(text, href) : make('span', text));
    if (place === parts.length - 1) item.setAttribute('aria-current', 'page');
    return item;
  }));
  document.title = `${parts.map(([text]) => text).join(' – ') || 'Runs and trips'} – Chauffeur`;
}

function trouble(error) {
  $('trouble').hidden = !error;
  $('trouble').textContent = error ? error.message : '';
}

function stateMark(entry) {
  const mark = make('span', STATES[entry.state] || '', `state ${entry.state}`);
  if (entry.trouble) mark.title = entry.trouble;
  return mark;
}

/* ---- the list of all ---- */

function progress(entry) {
  if (entry.planned === undefined) return make('span', '');
  const text = entry.done === entry.planned ? entry.planned.toLocaleString('en') : `${entry.done.toLocaleString('en')} of ${entry.planned.toLocaleString('en')}`;
  const cell = make('b', text);
  if (entry.done === entry.planned) return cell;
  const meter = drawn('svg', { class: 'meter', viewBox: '0 0 100 4', preserveAspectRatio: 'none', 'aria-hidden': 'true' });
  meter.append(drawn('path', { class: 'whole', d: 'M0 2H100' }), drawn('path', { class: 'part', d: `M0 2H${(100 * entry.done) / Math.max(entry.planned, 1)}` }));
  return box('span', null, cell, meter);
}

function runLine(entry) {
  const check = document.createElement('input');
  check.type = 'checkbox';
  check.checked = memory.chosen.has(entry.id);
  check.disabled = entry.trouble !== undefined;
  check.setAttribute('aria-label', `Choose ${entry.where} to compare`);
  check.addEventListener('change', () => {
    if (check.checked) memory.chosen.add(entry.id);
    else memory.chosen.delete(entry.id);
    drawChosen();
  });
  const cell = (head, ...children) => {
    const node = box('td', null, ...children);
    node.dataset.head = head;
    return node;
  };
  const name = entry.trouble === undefined ? link(entry.name, `#/runs/${entry.id}`) : make('span', entry.name);
  const head = box('th', null, box('span', 'pick', check, box('span', null, name, ...labels(entry.labels || []), make('small', entry.trouble && entry.state === 'unreadable' ? entry.trouble : entry.where))));
  head.scope = 'row';
  const figure = entry.headline ? [make('b', entry.headline.text), make('small', `${entry.headline.title} ${entry.headline.unit}`), make('small', entry.headline.table)] : [];
  const judge = entry.judge ? folded(entry.judge.split(/[.:;,]/)[0].slice(0, 60), make('p', entry.judge)) : null;
  const kind = entry.simulated === undefined ? '' : entry.simulated ? 'simulated drives' : 'answers, nothing drove';
  return box('tr', null, head, cell('Benchmark', entry.bench || ''), cell('When', make('span', when(entry.when)), stateMark(entry)), cell('Items', progress(entry)), cell('Headline', ...figure), cell('Kind', kind), cell('Judge', judge));
}

function tripLine(entry) {
  const row = document.createElement('tr');
  const name = entry.trouble === undefined ? link(`“${entry.name}”`, `#/trip/${entry.id}`) : make('span', entry.name);
  const head = box('th', null, name, make('small', entry.trouble || entry.where));
  head.scope = 'row';
  row.append(head);
  if (entry.trouble !== undefined) return row;
  const texts = [['Outcome', box('span', `ending ${entry.tone}`, entry.outcome)], ['Planner', entry.planner], ['Road', entry.place], ['Driven', `${entry.duration} s`], ['When', when(entry.when)], ['Kind', entry.simulated]];
  for (const [title, text] of texts) {
    const cell = box('td', null, text);
    cell.dataset.head = title;
    row.append(cell);
  }
  return row;
}

function indexTable(title, heads, lines, empty) {
  if (!lines.length) return box('section', 'card', make('h2', title), make('p', empty, 'note'));
  const top = box('tr', null, ...heads.map((text) => {
    const head = make('th', text);
    head.scope = 'col';
    return head;
  }));
  const scroll = box('div', 'scroll', box('table', 'index', make('caption', title, 'hidden'), box('thead', null, top), box('tbody', null, ...lines)));
  scroll.tabIndex = 0;
  scroll.setAttribute('role', 'region');
  scroll.setAttribute('aria-label', title);
  return box('section', 'card', make('h2', title), scroll);
}

function drawChosen() {
  const bar = $('chosen');
  if (!bar) return;
  const runs = memory.index.runs.filter((entry) => memory.chosen.has(entry.id));
  bar.replaceChildren();
  bar.hidden = runs.length < 2;
  if (bar.hidden) return;
  const alike = new Set(runs.map((entry) => entry.bench)).size === 1;
  const ids = held ? memory.index.order.filter((id) => memory.chosen.has(id)) : runs.map((entry) => entry.id).reverse();
  bar.append(alike ? link(`Compare ${runs.length} runs`, `#/runs/${ids.join('+')}`, 'action') : make('span', 'Runs of different benchmarks cannot be compared.'));
}

function drawIndex() {
  const { index } = memory;
  const words = memory.indexText.toLowerCase().split(/\s+/).filter(Boolean);
  const fits = (entry) => words.every((word) => JSON.stringify(Object.values(entry)).toLowerCase().includes(word));
  const order = { when: (a, b) => b.when - a.when, name: (a, b) => a.name.localeCompare(b.name), bench: (a, b) => (a.bench || '').localeCompare(b.bench || ''), headline: (a, b) => (b.headline?.value ?? -Infinity) - (a.headline?.value ?? -Infinity) };
  const runs = index.runs.filter(fits).sort(order[memory.sort]);
  const trips = index.trips.filter(fits);
  $('index-lists').replaceChildren(
    indexTable(`Runs (${runs.length})`, ['Run', 'Benchmark', 'When', 'Items', 'Headline', 'Kind', 'Judge'], runs.map(runLine), held ? 'This file holds none.' : `No run below ${index.folders.join(', ')}. Make one: chauffeur bench lampilot --data DbLv1`),
    indexTable(`Trips (${trips.length})`, ['Wish', 'Outcome', 'Planner', 'Road', 'Driven', 'When', 'Kind'], trips.map(tripLine), held ? 'This file holds none.' : 'No recorded trip. Make one: chauffeur drive "Overtake the car ahead" --save trips/overtake'),
  );
  drawChosen();
}

async function showIndex(mine) {
  memory.index = await ask('index');
  if (mine !== turn) return;
  crumbs(['Runs and trips', '']);
  const search = document.createElement('input');
  search.type = 'search';
  search.id = 'search';
  search.value = memory.indexText;
  search.addEventListener('input', () => {
    memory.indexText = search.value;
    drawIndex();
  });
  const sort = choice('Sort runs by', [['when', 'newest'], ['name', 'planner'], ['bench', 'benchmark'], ['headline', 'headline']], memory.sort, (value) => {
    memory.sort = value;
    drawIndex();
  });
  const chosen = make('p');
  chosen.id = 'chosen';
  const lists = make('div');
  lists.id = 'index-lists';
  const bar = box('form', 'filters', box('label', 'field search', make('span', 'Search'), search), sort, chosen);
  bar.addEventListener('submit', (event) => event.preventDefault());
  const partial = memory.index.partial ? make('p', 'There are more folders than are looked into; name those that you mean.', 'notice') : null;
  $('main').replaceChildren(...[make('h1', 'Runs and trips'), partial, bar, lists].filter(Boolean));
  drawIndex();
  refresh = drawIndex;
}

/* ---- runs ---- */

/* All there is of some runs, kept while they stay as they are. */
async function viewOf(key) {
  let view = memory.views.get(key);
  if (!view) {
    view = { key, ids: key.split('+'), report: null };
    await read(view);
    memory.views.set(key, view);
  }
  if (!memory.filters.has(key)) memory.filters.set(key, { ...NO_FILTER });
  return view;
}

/* Rows come at once; the intervals of the tables take longer. */
async function read(view) {
  const [runs, matches] = await Promise.all([Promise.all(view.ids.map((id) => ask(`rows ${id}`))), view.ids.length > 1 ? ask(`matches ${view.key}`) : null]);
  view.runs = runs;
  const places = matches || runs[0].rows.map((_, place) => [place]);
  // A run that goes on may have got rows between the two answers.
  view.entries = entriesOf(runs, places.filter((mine) => mine.every((place, at) => place < runs[at].rows.length)));
}

const nameOf = (view) => view.runs.map((run) => run.name).join(' and ');

function runHead(view) {
  const { report, runs } = view;
  const title = report ? report.title : `${runs[0].bench}: ${runs.map((run) => run.name).join(', ')}`;
  const items = new Set(view.entries.map((entry) => entry.rows[0].item)).size;
  const ruler = runs[0].ruler ? `, ruler ${runs[0].ruler}` : '';
  const state = box('p', 'subtitle', `${plural(items, 'item')}, ${plural(view.entries.length, 'row')}${ruler}. ${runs[0].simulated ? 'Simulated drives; no real car moved.' : 'Answers, judged as they stand; nothing drove.'}`, ...labels([...new Set(runs.flatMap((run) => run.labels))]));
  view.runs.forEach((run) => {
    const done = run.done < run.planned ? `, ${run.done.toLocaleString('en')} of ${run.planned.toLocaleString('en')} items` : '';
    if (run.state !== 'finished') state.append(' ', box('span', `state ${run.state}`, `${view.runs.length > 1 ? `${run.name}: ` : ''}${STATES[run.state]}${done}`));
  });
  const judge = runs[0].judge ? box('p', 'judge', make('b', 'Judge'), runs[0].judge) : null;
  return box('section', 'lead', make('h1', title), state, judge, ...(report && runs.every((run) => run.state !== 'running') ? report.notices : []).map((text) => make('p', text, 'notice')));
}

function results(view) {
  const { report } = view;
  if (!report) return make('p', 'The tables and their intervals are being counted …', 'note');
  const [first, ...others] = report.tables.map((table) => tableCard(table, report.simulated));
  return box('div', 'stack', first || null, ...report.pairs.map((table) => tableCard({ ...table, title: `Run against run. ${table.title}` }, report.simulated)), ...others);
}

function method(view) {
  if (!view.report) return make('p', 'The tables and their intervals are being counted …', 'note');
  const facts = view.report.facts.map(({ run, facts: entries }) => box('section', null, make('h3', run), pairs(entries)));
  return box('section', 'card', make('h2', 'How the figures were made'), make('p', view.report.intervals), ...facts);
}

function samples(view, key) {
  const filter = memory.filters.get(key);
  const count = make('p', '', 'count');
  count.setAttribute('role', 'status');
  const list = rowList(view.runs, filter, (place) => {
    view.at = place;
    location.hash = `#/runs/${key}/${view.shown[place].places.join('.')}`;
  });
  const changed = () => {
    view.shown = kept(view.runs, view.entries, filter);
    count.textContent = `${view.shown.length.toLocaleString('en')} of ${plural(view.entries.length, 'sample')}`;
    list.show(view.shown, 0);
  };
  const bar = box('div', null);
  const draw = () => bar.replaceChildren(filterBar(view.runs, view.entries, filter, changed));
  draw();
  view.redraw = () => {
    if (!bar.contains(document.activeElement)) draw();
    changed();
  };
  const clear = button('Clear filters', 'plain', () => {
    Object.assign(filter, NO_FILTER);
    draw();
    changed();
  });
  const keys = box('p', 'keys', make('kbd', '/'), ' search · ', make('kbd', '↑'), make('kbd', '↓'), ' choose · ', make('kbd', 'Enter'), ' open · ', make('kbd', 'Esc'), ' back');
  queueMicrotask(() => {
    changed();
    if (view.at) list.show(view.shown, view.at);
  });
  return box('section', 'card samples', bar, box('div', 'above', count, clear, keys), list.head, list.node);
}

const TABS = { results: ['Results', results], samples: ['Samples', samples], method: ['Method', method] };

async function showRuns(mine, key) {
  const view = await viewOf(key);
  if (mine !== turn) return;
  crumbs(['Runs and trips', '#/'], [nameOf(view), '']);
  const tabs = box('div', 'tabs');
  tabs.setAttribute('role', 'tablist');
  tabs.setAttribute('aria-label', 'Parts of the report');
  const panel = make('div');
  panel.id = 'panel';
  panel.setAttribute('role', 'tabpanel');
  const open = (name, focus) => {
    memory.tab = name;
    for (const tab of tabs.children) {
      const chosen = tab.dataset.tab === name;
      tab.setAttribute('aria-selected', String(chosen));
      tab.tabIndex = chosen ? 0 : -1;
      if (chosen && focus) tab.focus();
    }
    view.redraw = null;
    panel.replaceChildren(TABS[name][1](view, key));
    panel.setAttribute('aria-label', TABS[name][0]);
  };
  for (const [name, [text]] of Object.entries(TABS)) {
    const tab = button(name === 'samples' ? `${text} (${view.entries.length.toLocaleString('en')})` : text, 'tab', () => open(name));
    tab.dataset.tab = name;
    tab.setAttribute('role', 'tab');
    tab.setAttribute('aria-controls', 'panel');
    tabs.append(tab);
  }
  tabs.addEventListener('keydown', (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    const names = Object.keys(TABS);
    open(names[(names.indexOf(memory.tab) + step + names.length) % names.length], true);
  });
  const head = box('div', null, runHead(view));
  $('main').replaceChildren(head, tabs, panel);
  open(memory.tab);
  let tablesAt = performance.now();
  const count = async () => {
    tablesAt = performance.now();
    view.report = await ask(`report ${key}`);
    if (mine !== turn) return;
    head.replaceChildren(runHead(view));
    if (memory.tab !== 'samples') panel.replaceChildren(TABS[memory.tab][1](view, key));
  };
  if (!view.report) count().catch(trouble);
  refresh = async (changed) => {
    if (!view.ids.some((id) => changed.has(id))) return;
    await read(view);
    if (view.runs.every((run) => run.state !== 'running') || performance.now() - tablesAt > TABLES_MS) count().catch(trouble);
    if (mine !== turn) return;
    head.replaceChildren(runHead(view));
    tabs.querySelector('[data-tab="samples"]').textContent = `Samples (${view.entries.length.toLocaleString('en')})`;
    if (view.redraw) view.redraw();
  };
}

/* ---- a sample ---- */

async function showSample(mine, key, placesText) {
  const view = await viewOf(key);
  const places = placesText.split('.').map(Number);
  const found = await Promise.all(places.map((place, at) => ask(`sample ${view.ids[at]} ${place}`)));
  if (mine !== turn) return;
  const shown = view.shown || view.entries;
  const at = shown.findIndex((entry) => entry.places.join('.') === placesText);
  if (at >= 0) view.at = at;
  const rows = places.map((place, run) => view.runs[run].rows[place]);
  crumbs(['Runs and trips', '#/'], [nameOf(view), `#/runs/${key}`], [found[0].item, '']);
  const step = (by) => {
    const next = shown[at + by];
    if (next) location.hash = `#/runs/${key}/${next.places.join('.')}`;
  };
  const before = button('← Previous', 'plain', () => step(-1));
  const after = button('Next →', 'plain', () => step(1));
  before.disabled = at <= 0;
  after.disabled = at < 0 || at + 1 >= shown.length;
  const title = make('h1', found[0].words, found[0].words === found[0].item ? 'bare' : '');
  title.dir = 'auto';
  const head = box('section', 'sample-head', title,
    box('div', 'steps', before, after, make('span', at >= 0 ? `${(at + 1).toLocaleString('en')} of ${shown.length.toLocaleString('en')}` : '', 'count'), box('p', 'keys', make('kbd', '←'), make('kbd', '→'), ' sample · ', make('kbd', 'Esc'), ' back')),
    make('p', [found[0].item, rows[0].group].filter(Boolean).join(' · '), 'where'));
  const columns = found.map((sample, run) => {
    const others = found.length > 1 ? new Set(found.filter((_, other) => other !== run).flatMap((one) => [...linesOf(one)])) : null;
    const verdict = box('p', 'verdict', endingMark({ ...rows[run], ending: sample.ending }), ...rows[run].causes.map((cause) => make('span', cause, 'label')));
    const name = found.length > 1 ? make('h2', view.runs[run].name) : null;
    const drive = make('div', null, 'drive');
    return { words: box('article', 'card said-card', name, verdict, transcript(sample, others)), drive, sample, run };
  });
  const many = columns.length > 1;
  const alone = !many && !columns[0].sample.drivable;
  const layout = box('div', many ? 'beside' : alone ? 'alone' : 'sample', ...columns.map(({ words: said, drive, sample }) => (many ? box('div', 'column', said, sample.drivable ? drive : null) : said)), many || alone ? null : columns[0].drive);
  $('main').replaceChildren(head, layout);
  window.scrollTo(0, 0);
  memory.tab = 'samples';
  memory.step = step;
  for (const { drive, sample, run } of columns) fillDrive(drive, view.ids[run], places[run], sample).catch(trouble);
}

async function showTrip(mine, id) {
  const trip = await ask(`trip ${id}`);
  if (mine !== turn) return;
  memory.index = memory.index || (await ask('index'));
  const entry = memory.index.trips.find((one) => one.id === id);
  crumbs(['Runs and trips', '#/'], [entry ? entry.name : 'Trip', '']);
  const note = trip.note ? make('p', trip.note, 'notice') : null;
  $('main').replaceChildren(...[note, box('div', 'drive whole', framed(trip.page, 'The trip'))].filter(Boolean));
}

/* ---- the way ---- */

async function go() {
  const mine = (turn += 1);
  const [, what, key, places] = location.hash.split('/');
  refresh = null;
  memory.step = null;
  trouble(null);
  try {
    if (what === 'runs' && places) await showSample(mine, key, places);
    else if (what === 'runs') await showRuns(mine, key);
    else if (what === 'trip') await showTrip(mine, key);
    else await showIndex(mine);
  } catch (error) {
    if (mine === turn) {
      $('main').replaceChildren();
      trouble(error);
    }
  }
}

const typing = (target) => target.matches('input, select, textarea');

document.addEventListener('keydown', (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === '/' && !typing(event.target) && $('search')) {
    event.preventDefault();
    $('search').focus();
  } else if (event.key === 'Escape') {
    if (typing(event.target)) {
      event.target.blur();
      if ($('rows')) $('rows').focus();
    } else {
      const up = location.hash.split('/').slice(0, -1).join('/');
      location.hash = up === '#/runs' || up === '#/trip' ? '#/' : up;
    }
  } else if (memory.step && !typing(event.target) && (event.key === 'ArrowLeft' || event.key === 'ArrowRight') && !event.target.closest('[tabindex="0"]')) {
    memory.step(event.key === 'ArrowLeft' ? -1 : 1);
  }
});

/* Runs that changed since the last look; looked at again at most every two seconds. */
let pending = null;
line.changed = (index) => {
  const known = new Map((memory.index ? memory.index.runs : []).map((entry) => [entry.id, JSON.stringify(entry)]));
  const changed = new Set(index.runs.filter((entry) => known.get(entry.id) !== JSON.stringify(entry)).map((entry) => entry.id));
  memory.index = index;
  for (const key of memory.views.keys()) if (!location.hash.includes(key) && key.split('+').some((id) => changed.has(id))) memory.views.delete(key);
  if (pending) {
    for (const id of changed) pending.add(id);
    return;
  }
  pending = changed;
  setTimeout(async () => {
    const mine = pending;
    pending = null;
    try {
      if (refresh) await refresh(mine);
    } catch (error) {
      trouble(error);
    }
  }, LIVE_MS);
};

$('skip').addEventListener('click', (event) => {
  event.preventDefault();
  $('main').focus();
});
window.addEventListener('hashchange', go);
if (held && !location.hash) location.hash = held.opens;
go();
