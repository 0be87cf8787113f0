#include "deploy/wall/WallKeys.h"

#include <fmt/format.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

namespace tessera {

/// A folder of this process alone; its files go with it.
struct WallKeys::OwnFolder {
    explicit OwnFolder(std::string p) : path(std::move(p)) {}
    ~OwnFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
    OwnFolder(const OwnFolder&) = delete;
    OwnFolder& operator=(const OwnFolder&) = delete;
    std::string path;
};

Expected<WallKeys> WallKeys::in(const std::string& folder) {
    WallKeys keys{KeyFolder(folder)};
    if (const Expected<TlsKeys> server = keys.folder_.ofServer(); !server) return failWith("--keys", server.error());
    return keys;
}

Expected<WallKeys> WallKeys::forThisRun(const std::string& wall) {
    std::error_code error;
    std::string path = (std::filesystem::temp_directory_path(error) / "tessera-keys-XXXXXX").string();
    if (error || ::mkdtemp(path.data()) == nullptr)
        return fail(ErrorCode::kFailed,
                    fmt::format("no folder for the keys of this run can be made ({})", std::strerror(errno)));
    WallKeys keys{KeyFolder(path)};
    keys.own_ = std::make_shared<const OwnFolder>(path);
    const DateTime now = std::chrono::system_clock::now();
    keys.authority_ = std::make_shared<const Authority>(Authority::make(wall, now));
    const Identity server{.wall = wall, .kind = Identity::Kind::kServer, .name = {}};
    const Expected<Authority::Issued> issued = keys.authority_->issue(server, {}, now);
    if (!issued) return tl::unexpected(issued.error());
    const Expected<KeyFolder::Writer> writer = KeyFolder::Writer::open(keys.folder_);
    if (!writer) return tl::unexpected(writer.error());
    Expected<void> written = writer->write("authority.crt", keys.authority_->certificatePem());
    const std::vector<IssuedKey> all{{issued->certificate.serial, server, issued->certificate.until}};
    if (written) written = writer->write(all);
    if (written) written = writer->write(KeyFolder::fileOf(server), issued->pem);
    if (!written) return tl::unexpected(written.error());
    return keys;
}

Expected<std::string> WallKeys::bundleOf(const std::string& host) const {
    if (!authority_) {
        const Expected<TlsKeys> keys = folder_.ofHost(host);
        if (!keys) return tl::unexpected(keys.error());
        return KeyFolder::bundleOf(*keys);
    }
    const Identity holder{.wall = authority_->wall(), .kind = Identity::Kind::kHost, .name = host};
    const Expected<Authority::Issued> issued = authority_->issue(holder, {}, std::chrono::system_clock::now());
    if (!issued) return tl::unexpected(issued.error());
    TlsKeys keys;
    keys.own = issued->pem;
    keys.authority = authority_->certificatePem();
    return KeyFolder::bundleOf(keys);
}

}  // namespace tessera
