/// A whole render host: two threads of our own around one surface.
#pragma once

#include <optional>

#include "client/replica/Injection.h"
#include "client/replica/ShareMode.h"
#include "client/replica/TileWindows.h"
#include "common/base/ServiceNotifier.h"
#include "common/net/Transport.h"
#include "common/tls/KeyRing.h"
#include "common/wall/Culler.h"

namespace tessera {

struct HostOptions {
    Address server;
    std::string name;
    std::function<std::string(const std::string& peer)> access = {};  ///< see ServerLinkOptions
    CurrentKeys keys = {};                                            ///< empty: links are plain
    std::string output;
    std::string surface = "osmesa";    ///< "none": it takes part in every frame and draws nothing
    std::optional<int> device;         ///< of the surface "egl"
    int anisotropy = 0;                ///< RendererOptions
    std::size_t glMemoryBytes = 0;     ///< RendererOptions::memoryBytes
    std::optional<CullerKind> culler;  ///< none: the wall's
    bool window = false;               ///< each tile is shown on a monitor of this machine, by a tessera-window
    TileWindowsOptions windows;
    std::string cache;  ///< folder; empty: none
    bool keepFrames = false;
    Injection injection;
    ShareMode share = ShareMode::kAuto;  ///< of arrays and of parts of pictures, with hosts on this machine
    unsigned threads = 1;                ///< that drawing keeps busy
    ServiceNotifier* service = nullptr;  ///< that watches this program; null: nobody does
    /// Blobs that no scene names any more, kept in case one does again.
    std::uint64_t blobBudgetBytes = std::uint64_t{1} << 30;
    std::uint64_t cacheBudgetBytes = std::uint64_t{4} << 30;
};

/// Runs until the server says that it is over. The calling thread draws. Does not return when the draw thread hangs for
/// good and everything else is over: the process then ends with exit code 1.
[[nodiscard]] Expected<void> runHost(const HostOptions& options, Log& log);

}  // namespace tessera
