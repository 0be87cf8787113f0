// What stands above all tabs: which wall this is, how it is, who looks; and the banner while nothing comes.
import { loadAnew, startBanner } from './banner.js';
import { element, setChildren, setText } from './elements.js';
import { People } from './people.js';
import { authorization, keptToken } from './token.js';

/**
 * @param {import('./connection.js').Connection} connection
 * @param {import('./wall-status.js').WallStatus} status
 * @param {import('./schema.js').Schema} schema
 */
export function startHeader(connection, status, schema) {
  const part = (id) => document.getElementById(id);

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

  connection.addEventListener('open', async () => {
    part('api-link').href = keptToken() ? `/api.html?token=${encodeURIComponent(keptToken())}` : '/api.html';
    try {
      const { role } = await connection.ask('WhoAmI');
      setChildren(part('panel-links'), role === 'viewer' ? [] : await panelLinks());
    } catch {
      // Lost again: the banner says so.
    }
  });
  connection.addEventListener('lost', show);
  startBanner(part('banner'), connection);
  schema.addEventListener('outdated', () => loadAnew(part('banner')));
  show();
}

/** The panels that the server itself serves, each in a window of its own: their words are others than this page's. */
async function panelLinks() {
  const answer = await fetch('/panels', { headers: authorization() });
  return (await answer.json()).panels.map(({ title, token }) => element('a', {
    class: 'button panel-link', href: `/?token=${encodeURIComponent(token)}`, target: '_blank',
    rel: 'noopener noreferrer',
  }, element('span', { class: 'name', text: `▦ ${title || 'Panel'}` })));
}
