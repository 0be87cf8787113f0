// Tabs as WAI-ARIA describes them: one is in the order of the keyboard, arrows go to the others.

/**
 * @param {HTMLElement} list with role tablist
 * @param {(id: string) => void} onShow of the tab that is shown now, "wall" of "tab-wall"
 * @param {boolean} [isInAddress] false: of tabs within a tab
 * @returns {(name: string) => void} shows one
 */
export function startTabs(list, onShow, isInAddress = true) {
  const tabs = [...list.querySelectorAll('[role=tab]')];
  const show = (tab) => {
    for (const other of tabs) {
      const isShown = other === tab;
      other.setAttribute('aria-selected', String(isShown));
      other.tabIndex = isShown ? 0 : -1;
      document.getElementById(other.getAttribute('aria-controls')).hidden = !isShown;
    }
    const name = tab.id.slice('tab-'.length);
    if (isInAddress) history.replaceState(null, '', `#${name}`);
    onShow(name);
  };
  list.addEventListener('click', (event) => {
    const tab = event.target.closest('[role=tab]');
    if (tab) show(tab);
  });
  list.addEventListener('keydown', (event) => {
    const at = tabs.indexOf(document.activeElement);
    const next = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: tabs.length - 1 }[event.key];
    if (at < 0 || next === undefined) return;
    event.preventDefault();
    const tab = tabs.at(next % tabs.length);
    tab.focus();
    show(tab);
  });
  const addressed = () => tabs.find((tab) => `#${tab.id.slice('tab-'.length)}` === location.hash);
  show(addressed() ?? tabs[0]);
  // A bookmark of another tab; and what leads elsewhere on the page leaves this tab's address.
  if (isInAddress)
    addEventListener('hashchange', () => show(addressed() ?? tabs.find((tab) => tab.ariaSelected === 'true')));
  return (name) => show(tabs.find((tab) => tab.id === `tab-${name}`));
}
