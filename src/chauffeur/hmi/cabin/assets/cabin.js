/* The cabin page: what the session says goes to its place, what the person does goes to the session. */

import { makeConversation } from './conversation.js';
import { $, make, tell, write } from './elements.js';
import { makeHands } from './hands.js';
import { openLink } from './link.js';
import { makeMemory } from './memory.js';
import { makeMicrophone } from './microphone.js';
import { makeScene } from './scene.js';
import { NOT_HEARD, levelWords, speakIn, unitNow, whole } from './words.js';

const SILENCE_MS = 2500;
const WORDS_EVERY_MS = 1000;
const hint = () => (speaks() ? 'Hold the button and say what you want, or type it.' : ['Type what you want.', whyMute()].filter(Boolean).join(' '));

/* What one may do, while there is nothing to tell. */
function showHint(words = hint()) {
  $('heard').className = 'heard idle';
  write($('heard-words'), words);
}

const road = makeScene($('road'));
const conversation = makeConversation();
const memory = makeMemory({ order: (fields) => say('memory_order', fields) });

let session = null;
let scene = null;
let place = { wheel: 'free', screens: 1 };
let connection = 'connecting';
let ended = null;
let question = null; // what was heard and has to be confirmed
let listening = { state: 'off', button: '', why: '' };
let talking = ''; // button that is held here
let heardSceneAt = 0;
let wordsAt = 0;

const mine = () => place.wheel === 'mine';
const able = () => connection === 'open' && mine() && !ended;
const hears = () => Boolean(session && session.engine);
/* Whether this screen can be spoken to: a browser gives microphones only to pages on its own machine or over https. */
const speaks = () => hears() && Boolean(navigator.mediaDevices);
const whyMute = () => (!session ? '' : !hears() ? listening.why : 'To speak, open the page on the car’s own machine or over https.');

/* What a message does. */
const does = {
  session(told) { session = told; showSession(); },
  road(told) { road.setRoad(told); },
  scene(told) { heardSceneAt = performance.now(); scene = told; showScene(); },
  seat_view(told) { showSeat(told); },
  listening(told) { listening = told; showHeard(); },
  heard(told) { showHeardWords(told); },
  conversation(told) { speakIn(told.unit); conversation.told(told); },
  how_was_it(told) { conversation.askFor(told); },
  memory(told) { memory.told(told); },
  note(told) { conversation.note(told); },
  ended(told) { ended = told; tell(told.text || 'The drive is over.'); },
  place(told) { place = told; },
  answered(told) {
    if (told.question === 'heard') endQuestion();
    else conversation.askFor(null);
  },
};

const link = openLink({
  hear(message) {
    if (message.kind in does) does[message.kind](message);
    if (message.kind !== 'scene') showPlace();
  },
  changed(state) {
    if (state !== connection && state === 'lost') tell('Connection lost.');
    if (connection === 'lost' && state === 'open') tell('Connected again.');
    connection = state;
    if (state !== 'open') {
      hands.letAllGo();
      closeMicrophone();
    }
    showPlace();
  },
});

/* The view from the seat: rendered only while somebody looks, once a second. */
let looking = false;

function showSeat(told) {
  if (!looking) return;
  if (told.png) $('seat-picture').src = `data:image/png;base64,${told.png}`;
  $('seat-picture').hidden = !told.png;
  $('seat-picture').alt = `The road from the driver’s seat, ${told.time_s.toFixed(0)} s into the trip; rendered`;
  write($('seat-words'), told.png ? 'Simulated camera, once a second' : `No picture: ${told.why}`);
  $('seat').hidden = false;
}

$('look').addEventListener('click', () => {
  if (!say('show_seat', { on: !looking })) return;
  looking = !looking;
  $('look').setAttribute('aria-pressed', String(looking));
  write($('seat-words'), 'Simulated camera: waiting for a picture');
  $('seat-picture').hidden = true;
  $('seat').hidden = !looking;
});

/* Whether it was said. What cannot be said is told to the person, and nothing that was typed is lost. */
function say(kind, fields = {}) {
  if (ended) return refuse('The drive is over.');
  if (connection !== 'open') return refuse('Not sent: there is no connection to the car just now.');
  if (!mine() && kind !== 'stop') return refuse('Another screen has the wheel. Take it first.');
  return link.say(kind, fields);
}

function refuse(words) {
  conversation.note({ text: words, trouble: true });
  return false;
}

/* Where the page stands: connection, wheel, and what may be pressed. */
function showPlace() {
  const lost = connection === 'lost';
  write($('link'), ended ? 'Drive over' : { open: 'Connected', connecting: 'Connecting…', lost: 'Connection lost' }[connection] || 'Drive over');
  $('link').classList.toggle('bad', lost && !ended);
  $('place').hidden = place.screens < 2 && mine();
  write($('place'), mine() ? `You have the wheel, ${place.screens - 1} more ${place.screens === 2 ? 'screen looks' : 'screens look'} on` : 'You look on');
  $('take-wheel').hidden = connection !== 'open' || mine() || Boolean(ended);
  showBanner(lost);
  document.body.classList.toggle('lost', lost && !ended);
  if (scene) write($('level'), lost && !ended ? 'Last picture, no news since' : levelWords(scene));
  $('talk').hidden = !speaks(); // what cannot be used is not shown
  for (const row of document.querySelectorAll('.spoken')) row.hidden = !speaks();
  for (const id of ['talk-command', 'talk-evaluate']) $(id).disabled = !able() || !speaks();
  $('open-microphone').hidden = hears() && session.engine_remote; // sound leaves this machine only while a button is held
  $('open-microphone').disabled = !able();
  for (const button of document.querySelectorAll('.opinions button, #take-over, #as-opinion, .type .main')) button.disabled = Boolean(ended);
  $('stop').disabled = Boolean(ended);
  $('look').disabled = !able();
}

function showBanner(lost) {
  let words = '';
  if (ended) words = `The drive is over. ${ended.text}`;
  else if (lost) words = 'Connection lost. The car drives on by itself; this page keeps trying. What you typed is kept.';
  else if (connection === 'open' && heardSceneAt && performance.now() - heardSceneAt > SILENCE_MS) words = 'No news from the car for some seconds.';
  $('banner').hidden = !words;
  $('banner').classList.toggle('calm', Boolean(ended));
  write($('banner'), words);
}
setInterval(() => showBanner(connection === 'lost'), 1000);

function showSession() {
  const simulated = session.vehicle === 'simulated';
  write($('vehicle'), simulated ? 'Simulated drive' : `Real vehicle: ${session.vehicle}`);
  $('vehicle').classList.toggle('real', !simulated);
  document.body.classList.toggle('real', !simulated);
  write($('where'), session.title || session.scenario);
  $('limits').replaceChildren(...session.limits.map((text) => make('li', { text })));
  const engine = session.engine ? `${session.engine}${session.engine_remote ? ', elsewhere: sound leaves this machine' : ', on this machine'}` : 'nothing; type your wishes';
  const pairs = [
    ['Vehicle', simulated ? 'simulated' : session.vehicle], ['Place', session.scenario], ['Seed of its traffic', session.seed], ['Planner', session.planner],
    ['Listens with', engine], ['Person', session.person || 'nobody’s memory is used'], ['Control periods', `${Math.round(1 / session.dt_s)} a second`], ['Missed periods', '–'],
  ];
  $('session').replaceChildren(...pairs.flatMap(([name, value]) => [make('dt', { text: name }), make('dd', { text: String(value), id: name === 'Missed periods' ? 'missed' : null })]));
  if (!talking && !question) showHint();
  if (!session.person) memory.told({ person: '', private: false, retention_days: null, count: 0, newest: [] });
  showMicrophone(false);
}

function showScene() {
  road.show(scene);
  conversation.follow(scene);
  const speed = Math.abs(scene.ego.speed_mps);
  write($('speed'), String(whole(speed)));
  write($('limit'), scene.limit_mps > 0 ? String(whole(scene.limit_mps)) : '–');
  const target = scene.target_mps;
  write($('target'), target === null ? 'none' : String(whole(target)));
  for (const unit of document.querySelectorAll('.unit')) write(unit, unitNow());
  $('target-unit').hidden = target === null;
  const off = target === null ? 0 : target - speed;
  $('target-way').hidden = Math.abs(off) < 0.5;
  write($('target-sign'), off > 0 ? '▲' : '▼');
  write($('target-words'), off > 0 ? 'faster' : 'slower');
  $('level').hidden = false;
  write($('level'), levelWords(scene));
  $('shield').hidden = !scene.shield;
  write($('shield'), `Shield: ${scene.shield}`);
  if ($('missed')) write($('missed'), String(scene.missed));
  $('take-over').setAttribute('aria-pressed', String(scene.taken_over));
  write($('take-over').querySelector('.label'), scene.taken_over ? 'Give back' : 'Take over');
  $('pad').hidden = !scene.taken_over;
  document.body.classList.toggle('by-hand', scene.taken_over);
  const now = performance.now();
  if (now - wordsAt > WORDS_EVERY_MS) {
    wordsAt = now;
    write($('scene-words'), road.words());
  }
}

/* What was heard, and whether it is meant. */
function showHeardWords(heard) {
  question = heard.to_confirm ? heard : null;
  $('confirm').hidden = !question;
  const words = question && !heard.engine ? heard.reason : heard.status === 'heard' ? `Heard “${heard.text}”${question ? '. Is that what you mean?' : ''}` : [NOT_HEARD[heard.status], heard.reason].filter(Boolean).join(' ');
  write($('heard-words'), words);
  $('heard').className = `heard ${question ? 'asks' : { heard: 'good', no_hotword: '' }[heard.status] ?? 'bad'}`;
  if (heard.status !== 'no_hotword') tell(words); // people in a cabin talk
}

function endQuestion() {
  question = null;
  $('confirm').hidden = true;
  $('heard').className = 'heard';
}

function answer(yes) {
  if (!question || !say('confirm', { yes })) return;
  endQuestion();
  if (yes) showHint();
  else write($('heard-words'), 'Then say it again, or type it.');
}

function showHeard() {
  const words = { speaking: 'Listening…', recognising: 'Understanding…' }[listening.state];
  if (words && !question) {
    $('heard').className = 'heard busy';
    write($('heard-words'), words);
  } else if (!talking && $('heard').className === 'heard busy') {
    showHint();
  }
  if (!question && !talking && (listening.why || !speaks())) showHint(speaks() ? listening.why : hint());
}

/* Speaking. */
const microphone = makeMicrophone({
  sound: (samples) => link.sound(samples),
  level: (share) => document.documentElement.style.setProperty('--level', share.toFixed(2)),
  lost: (words) => { closeMicrophone(); refuse(words); },
});
let microphoneOn = false;
let queue = Promise.resolve(); // a button's messages leave in the order in which it was pressed

function press(which) {
  talking = which;
  showTalking('Just a moment…');
  queue = queue.then(async () => {
    if (!able()) return;
    try {
      await microphone.open();
    } catch (error) {
      refuse(error.message);
      showTalking();
      return;
    }
    if (talking !== which) {
      write($('heard-words'), 'Keep the button pressed while you speak.');
      tell('Keep the button pressed while you speak.');
      return;
    }
    if (!say('button', { button: which, held: true })) return;
    microphone.on();
    showTalking('Speak now');
    endQuestion();
    write($('heard-words'), 'Listening…');
    $('heard').className = 'heard busy';
    await released(which);
    await microphone.off();
    if (microphoneOn) microphone.on();
    link.say('button', { button: which, held: false });
  });
}

let onRelease = null;
const released = (which) => new Promise((resolve) => {
  if (talking !== which) resolve();
  else onRelease = resolve;
});

function release() {
  talking = '';
  showTalking();
  if (onRelease) onRelease();
  onRelease = null;
}

const LABELS = { command: 'Hold to talk', evaluate: 'Hold to evaluate' };
function showTalking(words = '') {
  for (const [which, label] of Object.entries(LABELS)) {
    $(`talk-${which}`).classList.toggle('held', talking === which);
    write($(`talk-${which}`).querySelector('.label'), talking === which && words ? words : label);
  }
}

async function toggleMicrophone() {
  if (microphoneOn) {
    microphoneOn = false;
    showMicrophone(false);
    await microphone.off();
    return;
  }
  try {
    await microphone.open();
  } catch (error) {
    refuse(error.message);
    return;
  }
  microphone.on();
  microphoneOn = true;
  showMicrophone(true);
}

function showMicrophone(on) {
  $('open-microphone').setAttribute('aria-pressed', String(on));
  write($('open-microphone').querySelector('.label'), on ? 'Microphone on: begin with “command”' : 'Microphone off');
}

function closeMicrophone() {
  microphoneOn = false;
  microphone.close();
  showMicrophone(false);
}

/* Typing, opinions, wheel. */
function send(asOpinion) {
  const text = $('wish').value.trim();
  if (!text) {
    $('wish').focus();
    return;
  }
  const sent = asOpinion ? say('evaluate', { text, wish: conversation.asked() }) : say('say', { text });
  if (sent) {
    $('wish').value = '';
    $('wish').blur(); // the keys are the page's again; "/" comes back
  }
  if (sent && asOpinion) conversation.askFor(null);
}

function giveOpinion(text) {
  if (!say('evaluate', { text, wish: conversation.asked() })) return;
  conversation.askFor(null);
  tell(`Told the car: ${text}`);
}

function stop() {
  if (say('stop')) tell('The car is told to stop.');
}

function takeOver() {
  say('take_over', { on: !(scene && scene.taken_over) });
}

const hands = makeHands({
  press: (which) => { if (able() && speaks()) press(which); },
  release,
  driving: () => Boolean(scene && scene.taken_over),
  shortcuts: () => $('shortcuts').checked,
  act: { hand: (key) => say('hand', { key }), takeOver, stop, type: () => $('wish').focus(), answer },
});

$('type').addEventListener('submit', (event) => {
  event.preventDefault();
  send(false);
});
$('as-opinion').addEventListener('click', () => send(true));
$('yes').addEventListener('click', () => answer(true));
$('no').addEventListener('click', () => answer(false));
$('stop').addEventListener('click', stop);
$('take-over').addEventListener('click', takeOver);
$('take-wheel').addEventListener('click', () => link.say('wheel'));
$('open-microphone').addEventListener('click', toggleMicrophone);
for (const button of document.querySelectorAll('[data-opinion]')) button.addEventListener('click', () => giveOpinion(button.dataset.opinion));

const tabs = [...document.querySelectorAll('[role=tab]')];
function choose(tab) {
  for (const other of tabs) {
    other.setAttribute('aria-selected', String(other === tab));
    other.tabIndex = other === tab ? 0 : -1;
    $(other.getAttribute('aria-controls')).hidden = other !== tab;
  }
}
for (const [i, tab] of tabs.entries()) {
  tab.addEventListener('click', () => choose(tab));
  tab.addEventListener('keydown', (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const next = tabs[(i + step + tabs.length) % tabs.length];
    choose(next);
    next.focus();
  });
}

/* A screen that goes dark in the middle of a drive shows nothing. */
async function stayAwake() {
  if (document.hidden || !navigator.wakeLock) return;
  try {
    await navigator.wakeLock.request('screen');
  } catch {
    // The device saves power; the drive does not depend on the screen.
  }
}
document.addEventListener('visibilitychange', stayAwake);
stayAwake();
showPlace();
