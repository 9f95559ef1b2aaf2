/* Every wish, and what became of it: newest first, the newest one open. */

import { $, make, tell, write } from './elements.js';
import { checkName, seconds, stageWords } from './words.js';

const MOST_NOTES = 4;
const NOTE_MS = 20000;
const STEPS = [
  ['wait_s', 'waiting for you to finish'], ['recognise_s', 'understanding the words'], ['plan_s', 'planning'],
  ['check_s', 'checks'], ['set_point_s', 'until the car heard it'],
];

export function makeConversation() {
  const wishes = new Map(); // id to {told, node, opened, shielded}
  let driven = { wish: '', line: null };
  let asked = '';

  function told(wish) {
    const known = wishes.get(wish.wish);
    const entry = known || { node: make('li', { class: 'wish' }), opened: null, checked: false, shielded: [], at: 0 };
    const before = entry.told;
    entry.told = wish;
    wishes.set(wish.wish, entry);
    if (!known) {
      $('wishes').prepend(entry.node);
      for (const other of wishes.values()) if (other !== entry && other.node.firstChild) other.node.firstChild.open = other.opened === true;
    }
    render(entry);
    $('no-wish').hidden = true;
    const [, words] = stageWords(wish);
    if (!before || before.stage !== wish.stage || before.outcome !== wish.outcome) {
      tell(`${wish.text}: ${words}. ${wish.stage === 'closed' || wish.stage === 'driven' ? wish.why : ''}`);
    }
  }

  const newest = () => [...wishes.values()].at(-1) || null;

  function render(entry) {
    const { told: wish } = entry;
    const [sign, words, tone] = stageWords(wish);
    const open = entry.opened ?? entry === newest();
    const summary = make('summary', { 'data-part': 'wish' },
      make('span', { class: 'how' }, make('span', { class: `state ${tone}` }, make('span', { class: 'sign', 'aria-hidden': 'true', text: sign }), words),
        make('span', { class: 'id', text: wish.follows ? `your opinion on ${wish.follows} · ${wish.wish}` : `${wish.spoken ? 'said' : 'typed'} · ${wish.wish}` })),
      make('span', { class: 'said-words', dir: 'auto', text: wish.text }));
    summary.addEventListener('click', () => { entry.opened = !entry.node.firstChild.open; });
    const had = entry.node.contains(document.activeElement) ? document.activeElement.dataset.part : '';
    entry.node.replaceChildren(make('details', { open }, summary, ...body(entry)));
    const code = entry.node.querySelector('.code');
    if (code) code.scrollTop = entry.at;
    if (had) entry.node.querySelector(`[data-part=${had}]`)?.focus();
    markLine();
  }

  function body(entry) {
    const { told: wish, shielded } = entry;
    return [
      wish.why && make('p', { class: 'why', text: wish.why }),
      wish.waits && make('p', { class: 'why', text: 'Pending. Say “never mind” to take it back.' }),
      ...wish.said.map((line) => make('p', { class: 'car-said' }, make('b', { text: 'The car says ' }), `“${line}”`)),
      wish.thoughts && wish.thoughts !== wish.why && section('It thinks', make('p', { class: 'thoughts', text: wish.thoughts })),
      ...refusedBy(wish),
      shielded.length && section('The shield stepped in', make('ul', { class: 'plain shielded' }, ...shielded.map((text) => make('li', { text })))),
      wish.recalled.length && section('From what it knows of you', make('ul', { class: 'plain' }, ...wish.recalled.map((text) => make('li', { text })))),
      wish.opinion && section('You said of it', make('p', { text: `“${wish.opinion}”` })),
      wish.remembered && make('p', { class: 'fine', text: wish.remembered }),
      detail(entry),
    ].filter(Boolean);
  }

  /* What the passenger need not know; on a small screen it is folded. */
  function detail(entry) {
    const { told: wish } = entry;
    const parts = [
      wish.source && section(wish.policy === 'parameters' ? 'It sets' : 'It drives by', code(wish, entry)),
      wish.verdicts.length && section('Checks', ...checks(wish, entry)),
      wish.stages.total_s !== null && section(`From ${wish.spoken ? 'your last word' : 'Enter'} to the first change`, latency(wish)),
    ].filter(Boolean);
    if (!parts.length) return null;
    const folded = make('details', { class: 'detail', open: entry.detailed ?? matchMedia('(min-width: 46.01rem)').matches },
      make('summary', { 'data-part': 'detail', text: 'How it decided' }), ...parts);
    folded.firstChild.addEventListener('click', () => { entry.detailed = !folded.open; });
    return folded;
  }

  const section = (title, ...content) => make('section', { class: 'part' }, make('h3', { text: title }), ...content);

  /* A wrapped line hangs two characters deeper than it begins. */
  function line(text, i) {
    const words = make('code', { text: text || ' ' });
    const depth = /^ */.exec(text)[0].length + 2;
    words.style.paddingLeft = `${depth}ch`;
    words.style.textIndent = `-${depth}ch`;
    return make('li', { 'data-line': i + 1 }, words);
  }

  function code(wish, entry) {
    const lines = wish.source.replace(/\n+$/, '').split('\n');
    const name = wish.policy === 'parameters' ? 'Parameters' : 'Program';
    const list = make('ol', { class: `code ${wish.policy}`, tabindex: 0, 'aria-label': name, 'data-part': 'code' }, ...lines.map(line));
    list.addEventListener('scroll', () => { entry.at = list.scrollTop; });
    return list;
  }

  const failed = (one) => !one.passed && one.compared !== false;

  /* What did not pass is always seen; what passed, on demand. */
  function refusedBy(wish) {
    const found = wish.verdicts.filter(failed);
    return found.length ? [section('Did not pass', make('ul', { class: 'verdicts' }, ...found.map(verdict)))] : [];
  }

  function checks(wish, entry) {
    const [passed, open] = [wish.verdicts.filter(proven), wish.verdicts.filter((one) => !proven(one) && !failed(one))];
    const all = make('details', { class: 'checked', open: entry.checked },
      make('summary', { 'data-part': 'checks' }, make('span', { class: 'sign', 'aria-hidden': 'true', text: '✓' }), ` ${passed.length} passed: ${passed.map((one) => checkName(one.check)).join(', ')}`),
      make('ul', { class: 'verdicts' }, ...passed.map(verdict)));
    all.addEventListener('toggle', () => { entry.checked = all.open; });
    return [open.length ? make('ul', { class: 'verdicts' }, ...open.map(verdict)) : null, passed.length ? all : null].filter(Boolean);
  }

  /* Only what was shown to be right gets a tick; where nothing was compared, that is said. */
  function proven(one) {
    return one.passed && one.proven !== false && one.compared !== false;
  }

  function verdict(one) {
    if (one.compared === false && (one.passed || one.informs)) {
      return make('li', { class: 'uncompared' },
        make('span', { class: 'sign', 'aria-hidden': 'true', text: '–' }),
        make('span', {}, make('b', { text: `${checkName(one.check)} not compared` }), one.reason ? `: ${one.reason}` : ''));
    }
    const open = one.passed && !proven(one);
    const outcome = open ? 'found nothing wrong, and did not prove all' : one.passed ? 'passed' : one.informs ? 'did not pass, which stops nothing' : 'did not pass';
    return make('li', { class: open ? 'open' : one.passed ? 'passed' : 'failed' },
      make('span', { class: 'sign', 'aria-hidden': 'true', text: open ? '~' : one.passed ? '✓' : one.informs ? '≠' : '✕' }),
      make('span', {}, make('b', { text: `${checkName(one.check)} ${outcome}` }), one.reason ? `: ${one.reason}` : ''));
  }

  function latency(wish) {
    const { stages } = wish;
    const steps = STEPS.map(([name, words], i) => ({ share: stages[name], words, i })).filter((step) => step.share);
    const bar = make('div', { class: 'latency', 'aria-hidden': 'true' }, ...steps.map((step) => {
      const part = make('i', { class: `step-${step.i}` });
      part.style.flexGrow = step.share * 1000; // less than 1 in all would leave a gap
      return part;
    }));
    const legend = make('ul', { class: 'legend' }, make('li', { class: 'total', text: `${seconds(stages.total_s)} in all` }),
      ...steps.map((step) => make('li', {}, make('i', { class: `step-${step.i}`, 'aria-hidden': 'true' }), `${seconds(step.share)} ${step.words}`)));
    return make('div', {}, bar, legend);
  }

  /* The line at which the program waits, and what the shield does meanwhile. */
  function follow(scene) {
    driven = { wish: scene.wish, line: scene.line };
    const entry = wishes.get(scene.wish) || (scene.shield ? newest() : null);
    if (entry && scene.shield && !entry.shielded.includes(scene.shield)) {
      entry.shielded.push(scene.shield);
      render(entry);
    } else {
      markLine();
    }
  }

  function markLine() {
    for (const [id, { node }] of wishes) {
      for (const item of node.querySelectorAll('.code.program li')) {
        const here = id === driven.wish && Number(item.dataset.line) === driven.line;
        if (here === item.hasAttribute('aria-current')) continue;
        if (here) {
          item.setAttribute('aria-current', 'step');
          const list = item.parentElement;
          if (list !== document.activeElement) list.scrollTop = item.offsetTop - list.clientHeight * 0.4;
        } else {
          item.removeAttribute('aria-current');
        }
      }
    }
  }

  /* Whose opinion is asked for; empty for the last wish. */
  function askFor(question) {
    asked = question ? question.wish : '';
    $('opinions').classList.toggle('asked', Boolean(question));
    write($('opinion-of'), question ? `How was “${question.text}”?` : 'How was it?');
    if (question) tell(`How was “${question.text}”?`);
  }

  function note({ text, trouble }) {
    const item = make('li', { class: trouble ? 'trouble' : '' },
      make('span', { class: 'sign', 'aria-hidden': 'true', text: trouble ? '!' : 'i' }),
      make('span', { class: 'note-words', text }),
      make('button', { type: 'button', class: 'close', 'aria-label': `Close: ${text}`, text: '×', onclick: () => item.remove() }));
    $('notes').prepend(item);
    if (!trouble) setTimeout(() => { if (!item.contains(document.activeElement)) item.remove(); }, NOTE_MS);
    while ($('notes').children.length > MOST_NOTES) $('notes').lastChild.remove();
    tell(text);
  }

  return { told, follow, askFor, note, asked: () => asked };
}

