// What stands above all tabs: which wall this is, how it is, who looks; and the banner while nothing comes.
import { element, setChildren, setText } from './elements.js';
import { People } from './people.js';
import { keepToken, keptToken } from './token.js';

/**
 * @param {import('./connection.js').Connection} connection
 * @param {import('./wall-status.js').WallStatus} status
 */
export function startHeader(connection, status) {
  const part = (id) => document.getElementById(id);
  const banner = part('banner');

  const show = () => {
    const { word, sign, tone } = status.describe();
    setText(part('wall-state'), `${sign} ${word}`);
    part('wall-state').dataset.tone = tone;
    const rate = status.frameRate;
    setText(part('frame-rate'), rate === null ? '–' : rate.toFixed(rate < 10 ? 1 : 0));
    if (!status.newest) return;
    setText(part('wall-name'), status.newest.wall_name);
    document.title = `${status.newest.wall_name} – Tessera`;
  };
  status.addEventListener('status', show);

  part('identity').replaceWith(new People(connection, status).button);

  connection.addEventListener('open', () => {
    banner.hidden = true;
    part('api-link').href = keptToken() ? `/api.html?token=${encodeURIComponent(keptToken())}` : '/api.html';
  });
  connection.addEventListener('lost', () => {
    show();
    if (!banner.hidden) return;
    const again = element('button', { type: 'button', text: 'Try now', onclick: () => connection.dial() });
    setChildren(banner, [element('p', { text: '◌ Connection lost. Trying again…' }), again]);
    banner.hidden = false;
  });
  connection.addEventListener('refused', ({ detail }) => {
    const input = element('input', { name: 'token', autocomplete: 'off', spellcheck: 'false', required: true });
    const form = element('form', {
      onsubmit: (event) => {
        event.preventDefault();
        keepToken(input.value.trim());
        connection.dial();
      },
    }, element('label', { text: 'Token ' }, input), element('button', { text: 'Come in' }));
    setChildren(banner, [element('p', { text: `✕ Not let in: ${detail}` }), form]);
    banner.hidden = false;
    input.focus();
  });
  show();
}
