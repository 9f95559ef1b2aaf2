/* Time: playing, scrubbing, marks, and bringing every part to the same instant. */
const GLYPHS = { said: '“', lane_change: '⇄', stopped: '■', drove_on: '▸', finished: '●', failed: '✕', collision: '✸', off_road: '⚠', shield: 'S' };
const RATES = [0.5, 1, 2, 4, 8];
const STATES = { none: '', running: 'running', finished: 'finished', failed: 'failed' };
const CAPTION_S = 3;

function makePlayer() {
  const total = drive.time[drive.time.length - 1] || 0.1;
  const period = drive.time.length > 1 ? total / (drive.time.length - 1) : 0.1;
  const calm = window.matchMedia('(prefers-reduced-motion: reduce)');
  const lines = fillProgram();
  const setInstruments = makeInstruments();
  const stage = makeStage();
  const charts = makeCharts(total, (time) => { pause(); seek(time); });
  const scrub = $('scrub');
  let time = 0;
  let rate = 1;
  let playing = false;
  let last = null;
  let shown = -1;

  scrub.max = total;
  scrub.step = period.toFixed(3);
  $('total').textContent = `of ${seconds(total)}`;

  function showInstant(index) {
    if (index === shown) return;
    shown = index;
    const told = setInstruments(index);
    if (!playing) $('now').textContent = `${seconds(drive.time[index])}: ${told}`;
    const state = drive.state[index];
    $('program-state').textContent = STATES[state];
    $('program-state').className = `pill ${state}`;
    const current = drive.line[index];
    lines.forEach((line, n) => {
      if (n + 1 === current) line.setAttribute('aria-current', 'true');
      else line.removeAttribute('aria-current');
    });
    const now = lines[current - 1];
    if (now) {
      const box = $('program');
      const top = now.offsetTop;
      if (top < box.scrollTop || top + now.offsetHeight > box.scrollTop + box.clientHeight) {
        box.scrollTop = top - box.clientHeight / 2;
      }
    }
    const calls = drive.calls[index].map(([name, args, result]) => {
      const item = make('li');
      item.append(make('b', name), `(${args})`, make('span', ` → ${result}`));
      return item;
    });
    $('calls').replaceChildren(...(calls.length ? calls : [make('li', 'nothing', 'none')]));
    const said = drive.said.filter(([t]) => t <= drive.time[index] + 1e-6 && drive.time[index] < t + CAPTION_S);
    const words = said.length ? said[said.length - 1][1] : '';
    if ($('caption').textContent !== words) $('caption').textContent = words;
  }

  function show() {
    const exact = time / period;
    const at = Math.min(calm.matches ? Math.round(exact) : exact, drive.time.length - 1);
    const index = Math.min(Math.floor(at + 1e-6), drive.time.length - 1);
    stage.draw(at);
    showInstant(index);
    for (const chart of charts) chart.move(time, index);
    scrub.value = time;
    scrub.setAttribute('aria-valuetext', seconds(time));
    scrub.style.setProperty('--done', `${(time / total) * 100}%`);
    $('clock').textContent = seconds(time);
  }

  function seek(to) {
    time = Math.min(Math.max(to, 0), total);
    show();
  }

  function step(stamp) {
    if (!playing) return;
    if (last !== null) time += Math.min((stamp - last) / 1000, 0.25) * rate;
    last = stamp;
    if (time >= total) {
      time = total;
      pause();
    }
    show();
    if (playing) requestAnimationFrame(step);
  }

  function play() {
    if (time >= total - 1e-6) time = 0;
    playing = true;
    last = null;
    $('play').setAttribute('aria-label', 'Pause');
    requestAnimationFrame(step);
  }

  function pause() {
    playing = false;
    $('play').setAttribute('aria-label', 'Play');
  }

  const toggle = () => (playing ? pause() : play());

  function setRate(value) {
    rate = value;
    for (const input of $('rate').querySelectorAll('input')) input.checked = Number(input.value) === value;
  }

  for (const value of RATES) {
    const box = make('label');
    const input = make('input');
    Object.assign(input, { type: 'radio', name: 'rate', value, checked: value === 1 });
    input.addEventListener('change', () => setRate(value));
    box.append(input, `${value}×`);
    $('rate').append(box);
  }

  function placeMarks() {
    const box = $('marks');
    box.replaceChildren();
    const width = box.clientWidth;
    const taken = [[], []];
    const placed = [];
    const fits = (row, x) => taken[row].every((other) => Math.abs(other - x) >= 26);
    // The shield's marks come last: where others crowd, the spans and the list still hold all that it changed.
    const ofShield = (event) => event.kind === 'shield';
    for (const event of [...trip.events.filter((e) => !ofShield(e)), ...trip.events.filter(ofShield)]) {
      const x = (event.t / total) * width;
      const row = fits(0, x) ? 0 : 1;
      if (row && ofShield(event) && !fits(1, x)) continue;
      taken[row].push(x);
      const mark = make('button', GLYPHS[event.kind], `mark ${event.kind}${row ? ' high' : ''}`);
      mark.type = 'button';
      mark.style.left = `${x}px`;
      mark.title = `${seconds(event.t)}: ${event.label}`;
      mark.setAttribute('aria-label', mark.title);
      mark.addEventListener('click', () => { pause(); seek(event.t); });
      placed.push([event.t, mark]);
    }
    box.append(...placed.sort((a, b) => a[0] - b[0]).map(([, mark]) => mark));
    const high = taken[1].length > 0;
    box.classList.toggle('two', high);
    $('spans').hidden = !trip.shield;
    $('spans').replaceChildren(...(trip.shield ? trip.shield.stretches : []).map((stretch) => {
      const span = make('i');
      span.style.left = `${(stretch.t / total) * width}px`;
      span.style.width = `${Math.max(((stretch.end - stretch.t) / total) * width, 3)}px`;
      return span;
    }));
  }

  function resize() {
    stage.resize();
    for (const chart of charts) chart.resize();
    placeMarks();
    shown = -1;
    show();
  }

  $('play').addEventListener('click', toggle);
  scrub.addEventListener('input', () => { pause(); seek(Number(scrub.value)); });
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const typed = event.target.closest('button, input[type=radio], .code, summary');
    const jump = event.shiftKey ? 1 : period;
    const faster = RATES.indexOf(rate);
    const actions = {
      ' ': () => toggle(),
      ArrowLeft: () => { pause(); seek(time - jump); },
      ArrowRight: () => { pause(); seek(time + jump); },
      Home: () => { pause(); seek(0); },
      End: () => { pause(); seek(total); },
      ArrowUp: () => setRate(RATES[Math.min(faster + 1, RATES.length - 1)]),
      ArrowDown: () => setRate(RATES[Math.max(faster - 1, 0)]),
    };
    const action = actions[event.key];
    // A focused button, radio or scrolling program keeps its own keys.
    if (!action || (typed && !(typed === $('play') && event.key !== ' '))) return;
    event.preventDefault();
    action();
  });

  fillSteps((at) => { pause(); seek(at); });
  new ResizeObserver(resize).observe(document.querySelector('.frame'));
  window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', resize);
  resize();
  // `#t=12.3` opens the page at an instant; otherwise the drive starts, unless motion is unwelcome.
  const linked = /^#t=([\d.]+)$/.exec(window.location.hash);
  if (linked) seek(Number(linked[1]));
  else if (!calm.matches) play();
}

fillChecks();
fillThoughts();
fillResults();
fillHistory();
if (drive) {
  makePlayer();
} else {
  fillProgram();
  for (const id of ['player', 'calls', 'calls-title']) $(id).hidden = true;
}
