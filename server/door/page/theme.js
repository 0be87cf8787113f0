// Dark or light: as was chosen here, else as the device wants it, else dark.

import { element } from './elements.js';

const kKey = 'tessera-theme';

/** @param {HTMLButtonElement} button switches */
export function startTheme(button) {
  const wantsLight = matchMedia('(prefers-color-scheme: light)');
  const isForced = matchMedia('(forced-colors: active)');  // all but what is drawn here has the device's colours
  const show = () => {
    const theme = (!isForced.matches && localStorage.getItem(kKey)) || (wantsLight.matches ? 'light' : 'dark');
    document.documentElement.dataset.theme = theme;
    const [sign, word] = theme === 'dark' ? ['☀', 'Light'] : ['☾', 'Dark'];
    button.replaceChildren(sign, element('span', { class: 'wide', text: word }));
    button.setAttribute('aria-label', `${word} theme`);
    document.dispatchEvent(new Event('themechange'));  // who draws takes other colours
  };
  button.addEventListener('click', () => {
    localStorage.setItem(kKey, document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark');
    show();
  });
  for (const query of [wantsLight, isForced]) query.addEventListener('change', show);
  addEventListener('beforeprint', () => { document.documentElement.dataset.theme = 'light'; });  // paper is white
  addEventListener('afterprint', show);
  show();
}

/** @param {string} name of a colour in style.css, without its dashes */
export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}
