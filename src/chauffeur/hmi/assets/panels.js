/* Everything in words. Text is set with textContent only: what people and models wrote is never markup. */
const trip = JSON.parse(document.getElementById('trip-data').textContent);
const drive = trip.drive;
const $ = (id) => document.getElementById(id);

function make(tag, text, className) {
  const node = document.createElement(tag);
  if (text !== undefined && text !== null) node.textContent = text;
  if (className) node.className = className;
  return node;
}

function pair(list, term, value, small) {
  const dt = make('dt', term);
  if (small) dt.append(make('small', small));
  const dd = make('dd', value);
  list.append(dt, dd);
  return dd;
}

function speedWords(mps) {
  return `${mps.toFixed(1)} m/s (${(mps * 3.6).toFixed(0)} km/h)`;
}

function fillUnderstood() {
  const row = (term, value) => {
    if (!value) return;
    const box = make('div');
    box.append(make('dt', term), make('dd', value));
    $('understood').append(box);
  };
  row('Said by', trip.person);
  row('Understood as', trip.intent);
  for (const [name, value] of trip.settings) row(name, value);
  row('Declined', trip.refusal);
  row('Road', trip.title);
}

function fillProgram() {
  const box = $('program');
  if (!trip.program) {
    box.append(trip.policy ? make('pre', trip.policy) : make('p', trip.refusal || 'There is no program.'));
    return [];
  }
  const list = make('ol');
  const flagged = new Map(trip.verdicts.filter((v) => !v.passed && v.line).map((v) => [v.line, v.reason]));
  trip.program.forEach((tokens, index) => {
    const line = make('li');
    line.dataset.n = index + 1;
    const code = make('code');
    for (const [kind, text] of tokens) code.append(make('span', text, kind));
    // A wrapped line hangs two characters deeper than it begins.
    const depth = /^ */.exec(code.textContent)[0].length + 2;
    code.style.paddingLeft = `${depth}ch`;
    code.style.textIndent = `-${depth}ch`;
    line.append(code);
    if (flagged.has(index + 1)) {
      line.classList.add('flagged');
      line.title = flagged.get(index + 1);
    }
    list.append(line);
  });
  box.append(list);
  return [...list.children];
}

function fillVerdicts() {
  if (!trip.verdicts.length) $('verdicts').append(make('li', 'No check was run.', 'none'));
  for (const verdict of trip.verdicts) {
    const item = make('li', null, verdict.passed ? 'pass' : 'fail');
    const icon = make('b', verdict.passed ? '✓' : '✕');
    icon.setAttribute('aria-label', verdict.passed ? 'passed' : 'not passed');
    icon.setAttribute('role', 'img');
    const where = verdict.line ? `${verdict.check}, line ${verdict.line}` : verdict.check;
    item.append(icon, make('span', verdict.reason || (verdict.passed ? 'Passed.' : 'Not passed.')));
    if (verdict.remedy && !verdict.passed) item.append(make('span', verdict.remedy));
    item.append(make('small', where));
    $('verdicts').append(item);
  }
}

function fillResults() {
  $('outcome').classList.add(trip.outcome.tone);
  for (const cause of trip.outcome.causes) $('causes').append(make('li', cause));
  const scores = $('scores');
  pair(scores, 'Outcome', trip.outcome.label);
  pair(scores, 'Time driven', `${trip.duration.toFixed(1)} s`);
  for (const metric of trip.metrics) {
    const dd = pair(scores, metric.name, metric.value, metric.id);
    if (!metric.applies) dd.className = 'na';
  }
  $('thoughts').textContent = trip.thoughts || 'The planner gave no reasoning.';
  $('context').textContent = trip.context || 'No context was recorded.';
  for (const [name, value] of trip.provenance) pair($('provenance'), name, value);
}

function fillHistory() {
  if (!trip.history.length) $('history').append(make('li', 'Nothing was recalled for this wish.', 'none'));
  for (const item of trip.history) {
    const li = make('li');
    const about = [item.when.slice(0, 10), item.intent, item.outcome, `${Math.round(item.similarity * 100)} % alike`];
    li.append(make('q', item.instruction), make('small', about.filter(Boolean).join(' · ')));
    if (item.settings.length) li.append(make('small', item.settings.map(([n, v]) => `${n} ${v}`).join(' · ')));
    for (const said of item.feedback) {
      const quote = make('blockquote', said.text);
      quote.append(make('small', said.meaning));
      li.append(quote);
    }
    $('history').append(li);
  }
}

/* The four instruments under the road; returns a function that sets them for an instant. */
function makeInstruments() {
  const cells = ['Speed', 'Target', 'Gap ahead', 'Place'].map((name) => {
    const box = make('div');
    const value = make('dd');
    const sub = make('dd', null, 'sub');
    box.append(make('dt', name), value, sub);
    $('instruments').append(box);
    return { value, sub };
  });
  const [speed, target, gap, place] = cells;
  speed.value.className = 'ego';
  place.value.className = 'words';
  const put = (cell, mps) => {
    cell.value.textContent = `${mps.toFixed(1)} m/s`;
    cell.value.append(make('small', `${(mps * 3.6).toFixed(0)} km/h`));
  };
  return (index, mps) => {
    put(speed, mps);
    const a = drive.acceleration[index];
    speed.sub.textContent = `${a > 0 ? '+' : a < 0 ? '−' : ''}${Math.abs(a).toFixed(1)} m/s²`;
    const wanted = drive.target[index];
    if (wanted === null) target.value.textContent = 'as it is';
    else put(target, wanted);
    const limit = drive.limit[index];
    target.sub.textContent = limit === null ? '' : `limit ${speedWords(limit)}`;
    const distance = drive.gap[index];
    gap.value.textContent = distance === null ? 'none' : `${distance.toFixed(1)} m`;
    if (distance !== null && mps > 1) gap.value.append(make('small', `${(distance / mps).toFixed(1)} s`));
    const stop = drive.stop[index];
    gap.sub.textContent = stop !== null ? `stop sign in ${stop.toFixed(0)} m` : distance === null ? '' : 'centre to centre';
    const turn = drive.turn[index];
    place.value.textContent = drive.lane[index] || (turn ? `turning ${turn}`.replace('turning straight', 'going straight') : 'intersection');
    place.sub.textContent = drive.lane[index].startsWith('lane') ? 'counted from the left' : '';
  };
}
