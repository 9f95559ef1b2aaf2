/* What the car keeps of the person, and what they may do with it. */

import { $, make, tell } from './elements.js';
import { when } from './words.js';

const KEEP_DAYS = [7, 30, 90, 365];

export function makeMemory({ order }) {
  let state = null;
  let sure = false;

  function told(next) {
    if (state && next.private !== state.private) tell(next.private ? 'Private: nothing new is kept.' : 'What you wish is remembered again.');
    if (state && state.count !== next.count) sure = false;
    state = next;
    $('private').hidden = !state.private;
    $('memory-count').textContent = state.person ? ` ${state.count}` : '';
    render();
  }

  function entry(one) {
    return make('li', {},
      make('p', { class: 'said-words', dir: 'auto', text: one.text }),
      make('p', { class: 'fine' }, make('time', { datetime: one.when, text: when(one.when) }), one.outcome ? ` · ${one.outcome}` : ''),
      one.opinion ? make('p', { class: 'opinion-words' }, make('b', { text: 'You said ' }), `“${one.opinion}”`) : null);
  }

  function retention() {
    const days = state.retention_days;
    const choices = [...new Set([...KEEP_DAYS, ...(days === null ? [] : [days])])].sort((a, b) => a - b);
    const select = make('select', { id: 'retention' },
      ...choices.map((value) => make('option', { value, selected: value === days, text: value === 365 ? '1 year' : value === 1 ? '1 day' : `${value} days` })),
      make('option', { value: '', selected: days === null, text: 'for ever' }));
    select.addEventListener('change', () => order({ do: 'retention', days: select.value === '' ? null : Number(select.value) }));
    return make('p', { class: 'row' }, make('label', { for: 'retention', text: 'Keep each wish for' }), select, make('span', { class: 'fine', text: 'for everybody in this car' }));
  }

  function erasing() {
    if (!sure) {
      return make('button', { type: 'button', class: 'danger', id: 'erase', disabled: !state.count, text: 'Erase everything…', onclick: () => { sure = true; render('erase-sure'); } });
    }
    return make('div', { class: 'sure', role: 'group', 'aria-labelledby': 'sure-words' },
      make('p', { id: 'sure-words', text: `Erase all ${state.count} ${state.count === 1 ? 'entry' : 'entries'}${state.encrypted ? ' and the key they are locked with' : ''}? This cannot be undone.` }),
      make('p', { class: 'row' },
        make('button', { type: 'button', class: 'danger', id: 'erase-sure', text: 'Erase for good', onclick: () => { sure = false; order({ do: 'erase', sure: true }); render('erase'); } }),
        make('button', { type: 'button', text: 'Keep it', onclick: () => { sure = false; render('erase'); } })));
  }

  /* focus: id of the control that takes the place of the one just used. */
  function render(focus = document.activeElement && $('memory').contains(document.activeElement) ? document.activeElement.id : '') {
    if (!state) return;
    if (!state.person) {
      $('memory').replaceChildren(make('h2', { text: 'Nobody is remembered' }),
        make('p', { text: 'The drive was started without a name, so nothing of what you wish is kept, and nothing is recalled. Start it with a name, and the car learns how you like it.' }));
      return;
    }
    $('memory').replaceChildren(
      make('h2', { text: `What the car knows of ${state.person}` }),
      make('p', { class: 'row' }, make('button', {
        type: 'button', id: 'private-mode', class: 'toggle', 'aria-pressed': String(state.private), text: state.private ? 'Private mode is on' : 'Private mode is off',
        onclick: () => order({ do: state.private ? 'public' : 'private' }),
      })),
      make('p', { class: 'fine', text: state.private
        ? 'Nothing new is kept, of anybody in this car, until you switch it off. What was kept before still counts.'
        : `Your words, what became of them and your opinions are kept ${state.encrypted ? 'on this machine, encrypted' : `in the memory “${state.memory}”; the car does not encrypt them`}. Sound is never kept.` }),
      retention(),
      make('p', { class: 'row' },
        make('button', { type: 'button', id: 'forget-last', disabled: !state.count, text: 'Forget the last one', onclick: () => order({ do: 'forget_last' }) }),
        make('button', { type: 'button', id: 'export', disabled: !state.count, text: 'Export', onclick: () => order({ do: 'export' }) })),
      erasing(),
      make('h3', { text: state.count ? `${state.count} ${state.count === 1 ? 'wish' : 'wishes'}, newest first` : 'Nothing is remembered yet' }),
      make('ul', { class: 'entries' }, ...state.newest.map(entry)),
      state.count > state.newest.length ? make('p', { class: 'fine', text: `${state.count - state.newest.length} older ones are not shown; the export has all of them.` }) : '');
    if (focus && $(focus)) $(focus).focus();
  }

  return { told };
}
