// The word that lets in. It lives as long as the browser's tab, and does not stay in the address bar.

const kKey = 'tessera-token';

/** @returns {string | null} */
export function tokenInAddress() {
  return new URLSearchParams(location.search).get('token');
}

/** @returns {string} empty: none is known, which is right for who shows a certificate */
export function keptToken() {
  return sessionStorage.getItem(kKey) ?? '';
}

/** @param {string} token */
export function keepToken(token) {
  sessionStorage.setItem(kKey, token);
}

export function forgetToken() {
  sessionStorage.removeItem(kKey);
}

/** Takes the token out of the address bar, and what else a link says with it. */
export function takeToken() {
  const token = tokenInAddress();
  if (token) keepToken(token);
  if (location.search) history.replaceState(null, '', location.pathname + location.hash);
}

/** @returns {HeadersInit} for what is asked over HTTP */
export function authorization() {
  const token = keptToken();
  return token ? { Authorization: `Bearer ${token}` } : {};
}
