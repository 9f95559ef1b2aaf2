/* The person's side: keys out, instants in. What the car does is decided by the server alone. */
'use strict';

const $ = (id) => document.getElementById(id);
const KEYS = {
  ArrowLeft: 1, KeyA: 1, ArrowRight: 2, KeyD: 2, ArrowUp: 4, KeyW: 4, ArrowDown: 8, KeyS: 8,
};
const HEARTBEAT_MS = 80;
const SILENCE_MS = 500;
const FAMILY_HINTS = {
  routing: 'Stop sign and crossing traffic are yours to watch; crossing the centre line counts as leaving the road. It is done once you leave the crossing with the nose straight in your lane.',
};

const road = makeRoad($('road'));
const held = new Set();
let socket = null;
let closedFor = '';
let number = 0;
let sentAt = 0;
let item = null;
let stage = { stage: 'loading' };
let tick = null;
let before = null;
let heardAt = 0;
let offset = null;
let shownAt = 0;
let drawnAt = performance.now();

const mask = () => [...held].reduce((all, code) => all | KEYS[code], 0);
const kmh = (v) => (v * 3.6).toFixed(0);
const open = () => socket !== null && socket.readyState === WebSocket.OPEN;
const driving = () => stage.stage === 'driving';
const phase = () => (driving() && tick && tick.phase !== 'over' ? tick.phase : '');

function say(verb, more = {}) {
  if (open()) socket.send(JSON.stringify({ t: verb, ...more }));
}

function sendKeys() {
  if (!driving() || !open()) return;
  number += 1;
  sentAt = performance.now();
  say('keys', { k: mask(), n: number });
}

function connect() {
  socket = new WebSocket(`ws://${location.host}${location.pathname}drive`);
  socket.onmessage = (event) => receive(JSON.parse(event.data));
  socket.onclose = (event) => {
    closedFor = event.code === 4001 ? 'taken' : 'lost';
    if (closedFor === 'lost' && stage.stage !== 'done') setTimeout(connect, 1000);
    paint();
  };
  socket.onopen = () => { closedFor = ''; paint(); };
}

function receive(message) {
  if (message.t === 'item') {
    item = message;
    tick = { ...message.start, phase: 'start', wheel: 0, pedal: 0 };
    before = null;
    offset = null;
    road.setRoad(message.road);
    instruments();
  } else if (message.t === 'stage') {
    stage = message;
    shownAt = performance.now();
    held.clear();
    sendKeys();
  } else if (message.t === 'tick') {
    const now = performance.now();
    before = tick;
    tick = { wheel: 0, pedal: 0, ...message };
    heardAt = now;
    // The server's time on this page's clock, without the jitter of single messages.
    const fresh = message.time - now / 1000;
    offset = offset === null || Math.abs(fresh - offset) > 0.15 ? fresh : offset + (fresh - offset) * 0.15;
    instruments();
  }
  paint();
}

/* Between two instants everything is moved on with its own speed: what is drawn is never older than it must be. */
function scene() {
  const now = performance.now();
  const moving = phase() === 'driving' && now - heardAt < 400;
  const s = moving && offset !== null ? Math.min(Math.max(now / 1000 + offset - tick.time, -0.05), 0.15) : 0;
  const size = (id) => item.road.sizes[id] || [5, 2];
  const on = (x, y, h, v) => [x + Math.cos(h) * v * s, y + Math.sin(h) * v * s];
  const [x, y, h, v, crashed] = tick.ego;
  let spin = before && before.ego && tick.time > before.time ? (h - before.ego[2]) / (tick.time - before.time) : 0;
  if (Math.abs(spin) > 3) spin = 0;
  const [ex, ey] = on(x, y, h + (spin * s) / 2, v);
  const ego = { x: ex, y: ey, h: h + spin * s, l: size(0)[0], w: size(0)[1], v, crashed };
  const cars = tick.cars.map(([id, cx, cy, ch, cv, hit]) => {
    const [px, py] = on(cx, cy, ch, cv);
    return { id, x: px, y: py, h: ch, l: size(id)[0], w: size(id)[1], v: cv, crashed: hit };
  });
  const lead = tick.lead && cars.find((car) => car.id === tick.lead[0]);
  const leadWords = tick.lead ? `${tick.lead[1].toFixed(0)} m · ${tick.lead[2].toFixed(1)} m/s` : '';
  return { ego, cars, lead: tick.lead && tick.lead[1] < 130 ? lead : null, leadWords, braking: tick.pedal < -0.02 };
}

function instruments() {
  const v = tick.ego[3];
  $('speed').textContent = Math.abs(v).toFixed(1);
  $('speed-kmh').textContent = kmh(Math.abs(v));
  $('limit').textContent = tick.limit === null ? '–' : kmh(tick.limit);
  $('limit').parentElement.classList.toggle('over', tick.limit !== null && v > tick.limit + 0.5);
  $('gap').textContent = tick.lead ? `${tick.lead[1].toFixed(1)} m` : '–';
  $('lead').textContent = tick.lead ? `does ${tick.lead[2].toFixed(1)} m/s (${kmh(tick.lead[2])} km/h)` : 'none in this lane';
  $('sign-dial').hidden = tick.sign === null;
  if (tick.sign !== null) $('sign').textContent = `${tick.sign.toFixed(0)} m`;
  $('lane').textContent = !tick.lane || tick.off_road ? '–' : tick.lane[2] ? 'emergency' : `${tick.lane[0]} of ${tick.lane[1]}`;
  $('time').textContent = `${tick.time.toFixed(1)} s`;
  const a = tick.askew;
  $('askew').textContent = a === null || Math.abs(a) > 60 ? '–' : Math.abs(a) < 0.05 ? 'straight' : `${Math.abs(a).toFixed(1)}° ${a > 0 ? 'right' : 'left'}`;
  const wheel = $('wheel').style;
  wheel.left = `${50 + Math.min(0, tick.wheel) * 50}%`;
  wheel.width = `${Math.abs(tick.wheel) * 50}%`;
  const pedal = $('pedal');
  pedal.style.bottom = `${50 + Math.min(0, tick.pedal) * 50}%`;
  pedal.style.height = `${Math.abs(tick.pedal) * 50}%`;
  pedal.className = tick.pedal < 0 ? 'brake' : '';
}

function caps() {
  const down = mask();
  for (const bit of [1, 2, 4, 8]) $(`key-${bit}`).classList.toggle('down', Boolean(down & bit));
}

/* The card over the road: what is asked of the person now. */
function card({ pill = '', tone = '', title = '', text = '', pairs = [], fine = '', action = '', key = 'Enter', giveUp = false, side = false }) {
  $('veil').hidden = false;
  $('veil').classList.toggle('side', side);
  $('pill').hidden = !pill;
  $('pill').textContent = pill;
  $('pill').className = `pill ${tone}`;
  $('card-title').textContent = title;
  $('card-text').textContent = text;
  $('card-text').hidden = !text;
  $('card-fine').textContent = fine;
  $('card-fine').hidden = !fine;
  const list = $('card-pairs');
  list.hidden = !pairs.length;
  list.replaceChildren(...pairs.flatMap(([name, value, total]) => {
    const [dt, dd] = [document.createElement('dt'), document.createElement('dd')];
    dt.textContent = name;
    dd.textContent = value;
    if (total) for (const e of [dt, dd]) e.className = 'total';
    return [dt, dd];
  }));
  const button = $('main-action');
  button.hidden = !action;
  if (action) {
    const cap = document.createElement('kbd');
    cap.textContent = key;
    button.replaceChildren(action, cap);
  }
  $('give-up').hidden = !giveUp;
}

const points = (value) => (value === null ? 'does not apply' : `${value.toFixed(1)} pt`);

function paint() {
  show();
  const aside = !$('veil').hidden && $('veil').classList.contains('side');
  road.cover(aside ? $('card').getBoundingClientRect().right - $('road').getBoundingClientRect().left : 0);
}

function show() {
  if (item) {
    $('command').textContent = item.command;
    $('simulated').textContent = item.simulated;
    $('who').textContent = `human driver (${item.driver})`;
    $('place').textContent = `Drive ${item.place} of ${item.of}`;
    $('assist').hidden = !item.assist;
    const lead = item.start.lead ? `, ${item.start.lead[1].toFixed(1)} m behind a car doing ${item.start.lead[2].toFixed(1)} m/s` : ', no car ahead';
    $('start').textContent = `${item.start.ego[3].toFixed(1)} m/s${lead}`;
  }
  $('count').hidden = true;
  $('banner').hidden = true;
  const silent = phase() === 'driving' && performance.now() - heardAt > SILENCE_MS;
  if (closedFor === 'taken') {
    card({ title: 'Another window has the wheel', text: 'This one only shows where it was. Reload it to take the wheel back.' });
  } else if (stage.stage === 'done') {
    finished();
  } else if (closedFor === 'lost') {
    card({ pill: 'Connection lost', tone: 'bad', title: 'The pedals are released', text: 'The drive pauses until this page reaches the program again. Is it still running in the terminal?' });
  } else if (stage.stage === 'loading') {
    card({ title: 'Setting up the road…' });
  } else if (stage.stage === 'ready') {
    ready();
  } else if (stage.stage === 'result') {
    result();
  } else if (phase() === 'paused') {
    card({
      pill: 'Paused', title: 'The drive stands still',
      text: 'It goes on after a short countdown. Pauses are allowed, counted, and shown beside the result.',
      action: 'Go on', giveUp: true,
    });
  } else {
    $('veil').hidden = true;
    if (phase() === 'countdown') {
      $('count').hidden = false;
      $('count').textContent = Math.max(1, Math.ceil(tick.countdown));
    }
    if (silent || tick.released) {
      $('banner').hidden = false;
      $('banner').textContent = 'Connection lost: pedals released, wheel straight';
    }
  }
}

function ready() {
  const hint = FAMILY_HINTS[item.family] || '';
  card({
    pill: 'Ready', title: 'Do what the passenger asks, and keep to it',
    text: `The drive ends by itself once the wish is fulfilled, or can no longer be. ${hint}`.trim(),
    fine: `With no key held the car keeps its speed. A drive that was started counts: it cannot be repeated.${item.assist ? ' Lane-keeping assist is on; results say so.' : ''}`,
    action: 'Start the drive', side: true,
  });
}

function result() {
  const notes = [
    stage.detail,
    stage.late ? `This computer began ${stage.late} of the drive's periods late.` : '', stage.unsaved,
  ].filter(Boolean);
  const pairs = [['Time driven', `${stage.seconds.toFixed(1)} s`]];
  if (stage.success) pairs.push(...stage.scores.map(([name, value], i) => [name, points(value), i === 3]));
  const ends = {
    success: 'The wish is fulfilled.', collision: 'The car hit something.', off_road: 'The car left the road.',
    timeout: 'Time or road ran out before the wish was fulfilled.', failure: 'The wish was not fulfilled.',
  };
  card({
    pill: stage.label, tone: stage.tone, title: ends[stage.outcome] || stage.label,
    text: stage.success ? '' : 'A drive without success scores 0 points.', pairs, fine: notes.join(' '),
    action: stage.unsaved ? 'Try to store it again' : item.place === item.of ? 'See the whole run' : 'Next drive', side: true,
  });
  tally();
}

function tally() {
  if (stage.driven === undefined) return;
  const mean = stage.mean_score === null ? '' : ` · mean score of these ${stage.mean_score.toFixed(1)}`;
  $('tally').textContent = `${stage.driven} driven · ${stage.successes} as asked${mean}`;
}

function finished() {
  card({
    pill: 'All drives done', tone: 'good', title: `${stage.successes} of ${stage.driven} wishes fulfilled`,
    pairs: [['Collisions or off the road', String(stage.collisions)], ['Mean score of fulfilled wishes', points(stage.mean_score), true]],
    text: `The rows are in ${stage.folder}. The terminal shows the table; chauffeur report puts it beside other runs.`,
    fine: 'You may close this page.',
  });
}

function act() {
  if (performance.now() - shownAt < 500) return; // a key still going down from before
  if (stage.stage === 'ready') say('start', { item: item.id });
  else if (stage.stage === 'result') say('next', { item: item.id });
  else if (phase() === 'paused') say('go');
}

window.addEventListener('keydown', (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.code in KEYS) {
    event.preventDefault();
    if (event.repeat) return;
    held.add(event.code);
    sendKeys();
    caps();
  } else if (event.repeat) {
    if (event.code === 'Space') event.preventDefault();
  } else if (event.code === 'Enter' || event.code === 'NumpadEnter') {
    if (event.target === $('give-up')) return;
    event.preventDefault();
    act();
  } else if (event.code === 'Space') {
    event.preventDefault();
    if (phase() === 'paused') say('go');
    else if (phase()) say('pause');
  } else if (event.code === 'KeyV') {
    road.toggle();
  }
});
window.addEventListener('keyup', (event) => {
  if (held.delete(event.code)) { sendKeys(); caps(); }
});
function letGo() {
  held.clear();
  caps();
  sendKeys();
  if (phase() === 'driving' || phase() === 'countdown') say('pause');
}
window.addEventListener('blur', letGo);
document.addEventListener('visibilitychange', () => { if (document.hidden) letGo(); });
window.addEventListener('resize', () => { road.resize(); paint(); });
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => road.resize());
$('main-action').addEventListener('click', act);
$('give-up').addEventListener('click', () => say('give_up'));

setInterval(() => {
  if (performance.now() - sentAt >= HEARTBEAT_MS) sendKeys();
  if (phase() === 'driving' && performance.now() - heardAt > SILENCE_MS) paint();
}, 40);

function frame(now) {
  const dt = Math.min(0.1, (now - drawnAt) / 1000);
  drawnAt = now;
  if (item && tick) road.draw(scene(), dt);
  requestAnimationFrame(frame);
}
road.resize();
connect();
requestAnimationFrame(frame);
