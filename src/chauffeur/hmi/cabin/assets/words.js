/* Numbers and states as people read them. */

export const kmh = (mps) => Math.round(mps * 3.6);
export const seconds = (s) => (s < 0.995 ? `${Math.round(s * 100) * 10} ms` : `${s.toFixed(s < 9.95 ? 1 : 0)} s`);

/* Stage or outcome of a wish: [sign, words, tone]. */
const STAGES = {
  asked: ['…', 'Thinking', 'busy'],
  planned: ['…', 'Checking the plan', 'busy'],
  driven: ['▸', 'Driving it', 'drive'],
};
const OUTCOMES = {
  finished: ['✓', 'Done', 'good'],
  answered: ['✓', 'Answered', 'good'],
  declined: ['–', 'Declined', 'bad'],
  unplanned: ['✕', 'No plan could be made', 'bad'],
  refused: ['✕', 'Refused by a check', 'bad'],
  stale: ['✕', 'The plan came too late', 'bad'],
  superseded: ['↷', 'Gave way to a newer wish', 'neutral'],
  failed: ['✕', 'The program failed', 'bad'],
  interrupted: ['✕', 'Broken off', 'bad'],
};

export function stageWords(wish) {
  if (wish.stage === 'closed') return OUTCOMES[wish.outcome] || ['–', wish.outcome || 'Closed', 'neutral'];
  return STAGES[wish.stage] || ['…', wish.stage, 'busy'];
}

/* Where the car is going, and how far that is by road. */
export function goalWords({ name, left_m: left }) {
  return `To ${name || 'the destination'}, ${left < 1000 ? `${Math.round(left / 10) * 10} m` : `${(left / 1000).toFixed(1)} km`}`;
}

export function levelWords(scene) {
  if (scene.taken_over) return 'You drive. The shield stays on.';
  if (scene.level === 'follow' && scene.wish && scene.goal) return goalWords(scene.goal);
  if (scene.level === 'follow') return scene.wish ? 'Follows your wish' : 'Keeps its lane and distance';
  const levels = {
    hold: 'Holds the last wish', keep: 'Keeps lane, no faster', slow: 'Slows down, nobody tells it where to go', stop: 'Stops',
  };
  return levels[scene.level] || scene.level;
}

export const NOT_HEARD = {
  nothing: 'Nothing was said.',
  not_understood: 'Not understood.',
  no_hotword: 'Not meant for the car.',
  failed: 'Listening failed.',
};

export function when(iso) {
  const date = new Date(iso);
  if (Number.isNaN(date.getTime())) return iso;
  return date.toLocaleString([], { dateStyle: 'medium', timeStyle: 'short' });
}

/* A versioned check by its name: `format-v1` is format. */
export const checkName = (check) => check.replace(/-v\d+$/, '').replaceAll('-', ' ');
