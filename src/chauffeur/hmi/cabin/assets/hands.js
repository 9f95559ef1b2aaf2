/* The person's hands: buttons that are held to speak, keys, and the wheel when they take over. */

import { $ } from './elements.js';

const HAND_KEYS = { ArrowUp: 'faster', ArrowDown: 'slower', ArrowLeft: 'left', ArrowRight: 'right', KeyB: 'brake' };
const TALK_KEYS = { Space: 'command', KeyE: 'evaluate' };

const types = (element) => element instanceof HTMLElement && (element.matches('input:not([type=checkbox]), select, textarea') || element.isContentEditable);
const presses = (element) => element instanceof HTMLElement && element.matches('button, summary, a[href], input, [role=tab]');

/* press(which) and release(which): a talk button. act: {hand, takeOver, stop, type, answer}. driving(): whether the person drives. */
export function makeHands({ press, release, act, driving, shortcuts }) {
  const held = new Map(); // what holds (pointer, key, toggle) to which button

  function hold(by, which) {
    if (held.size) return;
    held.set(by, which);
    press(which);
  }

  function letGo(by) {
    const which = held.get(by);
    if (which === undefined) return;
    held.delete(by);
    release(which);
  }

  const letAllGo = () => [...held.keys()].forEach(letGo);

  for (const which of ['command', 'evaluate']) {
    const button = $(`talk-${which}`);
    let touched = false;
    button.addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      touched = true;
      button.setPointerCapture(event.pointerId);
      hold('pointer', which);
    });
    for (const end of ['pointerup', 'pointercancel', 'lostpointercapture']) button.addEventListener(end, () => letGo('pointer'));
    button.addEventListener('contextmenu', (event) => event.preventDefault());
    // A click without a finger or key down comes from a switch or a voice: once to begin, once to end.
    button.addEventListener('click', () => {
      if (!touched) (held.has('click') ? letGo : hold)('click', which);
      touched = false;
    });
    button.addEventListener('keydown', (event) => {
      if (event.code !== 'Space' && event.code !== 'Enter') return;
      event.preventDefault();
      event.stopPropagation();
      if (!event.repeat) hold(event.code, which);
    });
    button.addEventListener('keyup', (event) => {
      if (event.code === 'Space' || event.code === 'Enter') event.preventDefault();
      letGo(event.code);
    });
  }

  window.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.isComposing) return;
    const target = event.target;
    if (types(target)) {
      if (event.code === 'Escape') target.blur();
      return;
    }
    if (!shortcuts()) return;
    if (driving() && event.code in HAND_KEYS && !event.shiftKey && target.getAttribute?.('role') !== 'tab') {
      event.preventDefault();
      if (!event.repeat) act.hand(HAND_KEYS[event.code]);
    } else if (event.code in TALK_KEYS && !event.shiftKey && !(event.code === 'Space' && presses(target))) {
      event.preventDefault();
      if (!event.repeat) hold(event.code, TALK_KEYS[event.code]);
    } else if (event.repeat) {
      return;
    } else if (event.code === 'KeyS' && event.shiftKey) {
      act.stop();
    } else if (event.key === '/') {
      event.preventDefault();
      act.type();
    } else if (event.code === 'KeyT' && !event.shiftKey) {
      act.takeOver();
    } else if (event.key === 'y' || event.key === 'n') {
      act.answer(event.key === 'y');
    }
  });
  window.addEventListener('keyup', (event) => letGo(event.code));
  window.addEventListener('blur', letAllGo);
  document.addEventListener('visibilitychange', () => { if (document.hidden) letAllGo(); });

  for (const button of document.querySelectorAll('[data-hand]')) button.addEventListener('click', () => act.hand(button.dataset.hand));
  return { letAllGo };
}
