/* Numbers and states as people read them. */

/* Speeds whole, in the unit the person last used. */
let unit = 'km/h';
const OF = { 'km/h': 3.6, mph: 2.23694 };
export const unitNow = () => unit;
export const speakIn = (told) => { unit = told; };
export const whole = (mps) => Math.round(Math.abs(mps) * OF[unit]);
export const pace = (mps) => `${whole(mps)} ${unit}`;
export const seconds = (s) => (s < 0.995 ? `${Math.round(s * 100) * 10} ms` : `${s.toFixed(s < 9.95 ? 1 : 0)} s`);

/* Stage of a wish: [sign, words, tone]. */
const STAGES = {
  asked: ['…', 'Thinking', 'busy'],
  planned: ['…', 'Checking the plan', 'busy'],
  driven: ['▸', 'Driving it', 'drive'],
};
/* The result of a wish, in the words of every screen (concept/results.py): [sign, tone]. No tick: a drive in real time
   is not judged. */
const RESULTS = {
  done: ['■', 'good'],
  'partly done': ['■', 'neutral'],
  'not done': ['✕', 'bad'],
  'asked back': ['?', 'neutral'],
  declined: ['–', 'neutral'],
  failed: ['✕', 'bad'],
};

export function stageWords(wish) {
  if (wish.stage !== 'closed') return STAGES[wish.stage] || ['…', wish.stage, 'busy'];
  const [sign, tone] = RESULTS[wish.result] || ['–', 'neutral'];
  const words = wish.result || 'closed';
  return [sign, words[0].toUpperCase() + words.slice(1), tone];
}

/* Where the car is going, how far that is by road, and about how long it takes. */
export function goalWords({ name, left_m: left, left_s: time }) {
  const far = left < 1000 ? `${Math.round(left / 10) * 10} m` : `${(left / 1000).toFixed(1)} km`;
  return `To ${name || 'the destination'}, ${far}${time ? `, about ${time < 50 ? `${Math.max(1, Math.round(time / 10)) * 10} s` : `${Math.round(time / 60)} min`}` : ''}`;
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
