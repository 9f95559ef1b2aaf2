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

/* Speeds in the person's unit, whole. */
const pace = (mps) => (mps * trip.pace.of).toFixed(0);
const seconds = (time) => `${time.toFixed(1)} s`;

function fillProgram() {
  const box = $('program');
  if (!trip.program) {
    if (trip.policy) $('policy-kind').textContent = 'Policy';
    box.append(trip.policy ? make('pre', trip.policy) : make('p', 'There is no program.'));
    return [];
  }
  const list = make('ol');
  const flagged = new Map(trip.verdicts.filter((v) => !v.passed && v.vetoes && v.line).map((v) => [v.line, v.reason]));
  const doubted = new Map(trip.mismatches.filter((m) => m.line).map((m) => [m.line, `${m.kind}: ${m.instead}`]));
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

/* How a mark is called; which one a verdict gets was decided where it was judged. */
const MARKS = { passed: 'passed', open: 'not all proven', differs: 'does not fit', failed: 'not passed', not_compared: 'not compared' };

function markOf(mark, sign) {
  const icon = make('b', sign, mark);
  icon.setAttribute('aria-label', MARKS[mark]);
  icon.setAttribute('role', 'img');
  return icon;
}

/* For the person by name, with a reason where something is not as it should be; below, for engineers, all by id. */
function fillChecks() {
  const line = (mark, sign, ...texts) => {
    const item = make('li');
    item.append(markOf(mark, sign), ...texts.filter(Boolean).map((text) => make('span', text)));
    return item;
  };
  const grey = trip.verdicts.filter((v) => v.mark === 'not_compared');
  $('checked').hidden = grey.length === trip.verdicts.length;
  for (const verdict of trip.verdicts) {
    const { mark, sign, name } = verdict;
    const remedy = !verdict.passed && verdict.vetoes ? verdict.remedy : '';
    if (mark === 'passed' || mark === 'open') $('checks').append(line(mark, sign, mark === 'open' ? `${name}, not all proven` : name));
    else if (mark !== 'not_compared') $('checks').append(line(mark, sign, verdict.reason, remedy));
    const all = line(mark, sign, verdict.reason || MARKS[mark], remedy);
    all.append(make('small', verdict.line ? `${verdict.check}, line ${verdict.line}` : verdict.check));
    $('verdicts').append(all);
  }
  if (grey.length) $('checks').append(line('not_compared', grey[0].sign, `not compared: ${grey.map((v) => v.name).join(', ')}`));
  if (trip.shield) $('checks').append(line('shielded', 'S', trip.shield.summary));
}

function fillResults() {
  for (const cause of [...trip.outcome.causes, trip.outcome.end].filter(Boolean)) $('causes').append(make('li', cause));
  $('causes').append(make('li', [trip.title, trip.person && `said by ${trip.person}`].filter(Boolean).join('; '), 'muted'));
  $('judged').textContent = trip.outcome.judged || 'Nothing was held against the words.';
  const scores = $('scores');
  pair(scores, 'Time driven', seconds(trip.duration));
  pair(scores, 'Intent', trip.intent || 'not told');
  for (const [name, value] of trip.settings) pair(scores, name, value);
  for (const metric of trip.metrics) {
    const dd = pair(scores, metric.name, metric.value, metric.id);
    if (!metric.applies) dd.className = 'na';
  }
  $('context').textContent = trip.context || 'No context was recorded.';
  for (const [name, value] of trip.provenance) pair($('provenance'), name, value);
}

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
  $('why').hidden = !trip.thoughts && !trip.view;
  const text = trip.thoughts;
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

/* What happened when, and what the shield changed; each leads to its instant. */
function fillSteps(seek) {
  const step = (time, ...texts) => {
    const item = make('li');
    const at = make('button', seconds(time));
    at.type = 'button';
    at.setAttribute('aria-label', `Show ${seconds(time)}: ${texts[0]}`);
    at.addEventListener('click', () => seek(time));
    const what = make('span', texts[0]);
    if (texts[1]) what.append(make('small', texts[1]));
    item.append(at, what);
    return item;
  };
  $('happened').hidden = false;
  const told = trip.events.filter((event) => event.kind !== 'shield');
  $('steps').append(...told.map((event) => step(event.t, event.kind === 'said' ? `“${event.label}”` : event.label)));
  $('steps').append(step(trip.duration, 'The drive ends.'));
  if (!trip.shield) return;
  $('shield').hidden = false;
  for (const one of trip.shield.stretches) $('stretches').append(step(one.t, `${one.name}: ${one.change}`, `for ${seconds(one.end - one.t)}. ${one.reason}`));
}

const shieldAt = (time) => (trip.shield ? trip.shield.stretches.filter((s) => s.t <= time + 1e-6 && time < s.end - 1e-6) : []);

function fillHistory() {
  $('memory').hidden = !trip.history.length;
  for (const item of trip.history) {
    const li = make('li');
    const about = [item.when.slice(0, 10), item.outcome, ...item.settings.map(([n, v]) => `${n} ${v}`)];
    li.append(make('q', item.instruction), make('small', about.filter(Boolean).join(' · ')));
    for (const said of item.feedback) {
      const quote = make('blockquote', said.text);
      quote.append(make('small', said.meaning));
      li.append(quote);
    }
    $('history').append(li);
  }
}

/* The instruments under the road; returns a function that sets them for an instant and says them in a sentence. */
function makeInstruments() {
  const cells = Object.fromEntries(['Speed', 'Gap ahead', drive.to_go ? 'To go' : 'Lane', 'Doing'].map((name) => {
    const box = make('div');
    const value = make('dd');
    const sub = make('dd', null, 'sub');
    box.append(make('dt', name), value, sub);
    $('instruments').append(box);
    return [name, [value, sub]];
  }));
  cells.Speed[0].className = 'ego';
  const set = (name, value, sub) => {
    const [above, below] = cells[name];
    above.textContent = value;
    below.textContent = sub;
    return [name.toLowerCase(), value, sub].filter(Boolean).join(' ');
  };
  const clock = (time) => `${Math.floor(time / 60)}:${String(Math.floor(time % 60)).padStart(2, '0')} min`;
  return (index) => {
    const mps = drive.speed[index];
    const { unit } = trip.pace;
    const [wanted, limit, distance, stop] = [drive.target[index], drive.limit[index], drive.gap[index], drive.stop[index]];
    const bounds = [wanted !== null && `set to ${pace(wanted)}`, limit !== null && `limit ${pace(limit)}`];
    const behind = distance !== null && mps > 1 ? `${(distance / mps).toFixed(1)} s` : '';
    const told = [
      set('Speed', `${pace(mps)} ${unit}`, bounds.filter(Boolean).join(' · ')),
      set('Gap ahead', distance === null ? 'free' : `${distance.toFixed(0)} m`, stop === null ? behind : `stop sign in ${stop.toFixed(0)} m`),
    ];
    if (drive.to_go) {
      const left = Math.max(trip.duration - drive.time[index], 0);
      told.push(set('To go', `${drive.to_go[index].toFixed(0)} m`, [trip.going_to, drive.arrives && clock(left)].filter(Boolean).join(' · ')));
    } else {
      told.push(set('Lane', drive.lane[index].replace(/^lane /, '') || 'intersection', /of [2-9]/.test(drive.lane[index]) ? 'from the left' : ''));
    }
    const a = drive.acceleration[index];
    const turn = drive.turn[index];
    const pedals = mps < 0.3 ? 'standing' : a > 0.3 ? 'speeding up' : a < -0.3 ? 'braking' : 'steady';
    const why = shieldAt(drive.time[index]).map((s) => `shield: ${s.name}`)[0];
    told.push(set('Doing', pedals, why || (turn ? `turning ${turn}`.replace('turning straight', 'going straight') : '')));
    return told.join('; ');
  };
}
