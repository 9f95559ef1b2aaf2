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

/* Speeds in the person's unit, whole; what must not be exceeded is rounded down, but for what storing it has cost. */
const pace = (mps) => (mps * trip.pace.of).toFixed(0);
const atMost = (mps) => Math.floor(mps * trip.pace.of + 0.05).toFixed(0);

function fillUnderstood() {
  const row = (term, value) => {
    if (!value) return;
    const box = make('div');
    box.append(make('dt', term), make('dd', value));
    $('understood').append(box);
  };
  row({ 'asked back': 'Asked', done: 'Answer' }[trip.outcome.result] || 'Declined', trip.refusal);
  if (trip.outcome.end) row('At the end', trip.outcome.end);
  row('Going to', trip.going_to);
  row('Road', trip.title);
  row('Said by', trip.person);
}

function fillProgram() {
  const box = $('program');
  if (!trip.program) {
    if (trip.policy) $('policy-kind').textContent = 'Policy';
    box.append(trip.policy ? make('pre', trip.policy) : make('p', trip.refusal || 'There is no program.'));
    return [];
  }
  const list = make('ol');
  const flagged = new Map(trip.verdicts.filter((v) => !v.passed && v.vetoes && v.line).map((v) => [v.line, v.reason]));
  const doubted = new Map(trip.mismatches.filter((m) => m.line).map((m) => [m.line, mismatchWords(m)]));
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
    } else if (doubted.has(index + 1)) {
      line.classList.add('doubted');
      line.title = doubted.get(index + 1);
    }
    list.append(line);
  });
  box.append(list);
  return [...list.children];
}

/* What a mark looks like and is called; which one a verdict gets was decided where it was judged. */
const MARKS = { passed: ['pass', 'passed'], open: ['open', 'not proven'], differs: ['doubt', 'does not fit'], failed: ['fail', 'not passed'], not_compared: ['uncompared', 'not compared'] };

function fillVerdicts() {
  if (!trip.verdicts.length) $('verdicts').append(make('li', 'No check was run.', 'none'));
  for (const verdict of trip.verdicts) {
    const [look, said] = MARKS[verdict.mark];
    const item = make('li', null, look);
    const icon = make('b', verdict.sign);
    icon.setAttribute('aria-label', said);
    icon.setAttribute('role', 'img');
    const where = verdict.line ? `${verdict.check}, line ${verdict.line}` : verdict.check;
    item.append(icon, make('span', verdict.reason || (verdict.passed ? 'Passed.' : 'Not passed.')));
    if (verdict.remedy && !verdict.passed && verdict.vetoes) item.append(make('span', verdict.remedy));
    if (verdict.mark === 'differs') item.append(make('span', 'This informs; it stops nothing. The thoughts show where.'));
    item.append(make('small', where));
    $('verdicts').append(item);
  }
}

function fillResults() {
  $('outcome').classList.add(trip.outcome.tone);
  for (const cause of trip.outcome.causes) if (cause !== trip.refusal) $('causes').append(make('li', cause));
  $('judged').textContent = trip.outcome.judged || 'Nothing was driven that could be judged.';
  const scores = $('scores');
  pair(scores, 'Result', trip.outcome.label);
  pair(scores, 'Time driven', `${trip.duration.toFixed(1)} s`);
  pair(scores, 'Understood as', trip.intent || 'not told');
  for (const [name, value] of trip.settings) pair(scores, name, value);
  for (const metric of trip.metrics) {
    const dd = pair(scores, metric.name, metric.value, metric.id);
    if (!metric.applies) dd.className = 'na';
  }
  fillThoughts();
  $('context').textContent = trip.context || 'No context was recorded.';
  for (const [name, value] of trip.provenance) pair($('provenance'), name, value);
}

const mismatchWords = (m) => `${m.kind}: ${m.instead}${m.line ? ` (line ${m.line})` : ''}`;

/* The thoughts with every sentence marked that is not so, and below them what is so instead. */
function fillThoughts() {
  const box = $('thoughts');
  if (trip.view) {
    const image = document.createElement('img');
    image.src = trip.view;
    image.alt = 'What the front camera showed when the drive was planned, rendered';
    $('view').prepend(image);
    $('view').hidden = false;
  }
  const text = trip.thoughts || 'The planner gave no reasoning.';
  const wrong = new Map();
  for (const m of trip.mismatches) {
    const from = m.said ? text.indexOf(m.said) : -1;
    if (from >= 0) wrong.set(from, m.said.length);
  }
  let end = 0;
  for (const [from, length] of [...wrong].sort((a, b) => a[0] - b[0])) {
    if (from < end) continue;
    box.append(text.slice(end, from), make('mark', text.slice(from, from + length)));
    end = from + length;
  }
  box.append(text.slice(end));
  for (const m of trip.mismatches) {
    const item = make('li');
    item.append(make('b', m.kind));
    if (m.said) item.append(make('q', m.said));
    const but = m.said ? 'but ' : 'not mentioned: ';
    item.append(make('span', `${but}${m.instead}${m.line ? ` (line ${m.line})` : ''}.`));
    $('doubts').append(item);
  }
  $('doubts').hidden = !trip.mismatches.length;
}

/* What the run-time shield changed; each stretch leads to its instant. */
function fillShield(seek) {
  if (!trip.shield) return;
  $('shield').hidden = false;
  $('shield-summary').textContent = trip.shield.summary;
  for (const rule of trip.shield.rules) {
    const many = (count, one, more) => (count === 1 ? `1 ${one}` : `${count} ${more}`);
    const commands = many(rule.changes, 'command', 'commands');
    pair($('shield-rules'), rule.name, `${commands} in ${many(rule.stretches, 'stretch', 'stretches')}`);
  }
  for (const stretch of trip.shield.stretches) {
    const item = make('li');
    const at = make('button', `${stretch.t.toFixed(1)} s`);
    at.type = 'button';
    at.setAttribute('aria-label', `Show ${stretch.t.toFixed(1)} seconds: ${stretch.name}`);
    at.addEventListener('click', () => seek(stretch.t));
    const what = make('span');
    what.append(make('b', stretch.name), ` ${stretch.change} `, make('small', `for ${(stretch.end - stretch.t).toFixed(1)} s. ${stretch.reason}`));
    item.append(at, what);
    $('stretches').append(item);
  }
}

const shieldAt = (time) => (trip.shield ? trip.shield.stretches.filter((s) => s.t <= time + 1e-6 && time < s.end - 1e-6) : []);

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
  const put = (cell, number) => {
    cell.value.textContent = number;
    cell.value.append(make('small', trip.pace.unit));
  };
  return (index, mps) => {
    put(speed, pace(mps));
    const a = drive.acceleration[index];
    const signed = (value) => `${value > 0 ? '+' : value < 0 ? '−' : ''}${Math.abs(value).toFixed(1)}`;
    const asked = drive.asked[index];
    const held = shieldAt(drive.time[index]).length && Math.abs(asked - a) >= 0.05;
    speed.sub.textContent = held ? `${signed(a)} m/s², asked ${signed(asked)}` : `${signed(a)} m/s²`;
    const wanted = drive.target[index];
    if (wanted === null) target.value.textContent = 'as it is';
    else put(target, atMost(wanted));
    const limit = drive.limit[index];
    target.sub.textContent = limit === null ? '' : `limit ${atMost(limit)} ${trip.pace.unit}`;
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
