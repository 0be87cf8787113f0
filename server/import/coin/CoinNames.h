/// Coin's dictionary of names, as a table that grows with them.
#pragma once

namespace tessera {

/// Whether Coin takes it. It does where the program is linked so that a function of its own comes before that of a
/// library; else all is as it was, and slow with very many names.
[[nodiscard]] bool coinAsksHereForNames();

}  // namespace tessera
