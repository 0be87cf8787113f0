// On the page that asks for a token: who loads the console again has shown one in this window already.
import { forgetToken, keptToken, tokenInAddress } from './token.js';

const shown = tokenInAddress();
if (shown !== null) history.replaceState(null, '', location.pathname);
if (shown === keptToken()) forgetToken();  // it lets nobody in any more
const kept = keptToken();
if (kept) location.replace(`/?token=${encodeURIComponent(kept)}${location.hash}`);
