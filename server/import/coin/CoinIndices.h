/// Numbers of corners in a shape of Coin that lead nowhere: Coin reads what they name without looking.
#pragma once

#include <Inventor/actions/SoCallbackAction.h>

#include <string>

class SoNode;

namespace tessera {

/// Makes the shape safe to be traversed: faces and lines with a corner that does not exist shrink to one point, which
/// is drawn nowhere; numbers of colours, normals and texture coordinates become good ones, and lists that are too short
/// are filled up. Says what was wrong; empty: nothing. VRML 2's geometry.
[[nodiscard]] std::string mendVrmlIndices(SoNode& geometry);
/// Of Inventor's and VRML 1's shapes, in the action's state.
[[nodiscard]] std::string mendIndices(SoNode& shape, const SoCallbackAction& action);

}  // namespace tessera
