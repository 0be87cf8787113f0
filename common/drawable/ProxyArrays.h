/// The box of a ProxyGroup: twelve lines until its content is there.
#pragma once

#include "common/drawable/Derivation.h"

namespace tessera {

/// Nothing where the box has no extent. A box that is upside down is refused.
extern const Derivation kProxyDerivation;

}  // namespace tessera
