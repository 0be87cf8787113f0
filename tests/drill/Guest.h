/// Applications that do not behave as the library for applications does: they ask without waiting, read slowly or not
/// at all.
#pragma once

#include <string>

namespace tessera::drill {

/// What the drill starts itself as (`--guest KIND ADDR:PORT`), until it is told to end (SIGTERM); then it prints
/// "answered N".
///
///   status, picks, images   asks for that, many questions ahead of the answers
///   tree                    follows the scene anew again and again, as tessera-ctl tree does
///   slow                    follows the scene and reads 64 KiB a second
///   silent                  follows the scene, says that it lives, and reads nothing
///   crowd                   is no application: Crowd.h; prints how many stood, came, were closed and failed
///
/// Returns an exit code; 3: this system does not let it have what it needs.
[[nodiscard]] int runGuest(const std::string& kind, const std::string& address);

}  // namespace tessera::drill
