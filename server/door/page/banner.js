// What is said above all else while nothing comes from the wall: that it is lost, or why nobody is let in.
import { element, setChildren } from './elements.js';
import { keepToken } from './token.js';

/**
 * @param {HTMLElement} banner
 * @param {EventTarget & {dial: () => void}} connection says `open`, `lost` and `refused`
 */
export function startBanner(banner, connection) {
  connection.addEventListener('open', () => {
    const hadFocus = banner.contains(document.activeElement);
    banner.hidden = true;
    if (hadFocus) document.getElementById('content')?.focus({ preventScroll: true });
  });
  connection.addEventListener('lost', () => {
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
}

/** For a page of another version than the wall's: at once, but for who is in the middle of something. */
export function loadAnew(banner) {
  if (!document.querySelector('dialog[open], :is(input, textarea, select):focus, .transfers > *'))
    return location.reload();
  const reload = element('button', { type: 'button', text: 'Load the page anew', onclick: () => location.reload() });
  setChildren(banner, [element('p', { text: '↻ The wall has another version now.' }), reload]);
  banner.hidden = false;
}
