/// The files that a scene of Coin is made of: the one that is read, and those in its folder that it takes in.
#pragma once

#include <Inventor/nodes/SoSeparator.h>

#include <map>
#include <string>
#include <vector>

#include "server/import/coin/CoinText.h"
#include "server/import/reader/FolderFiles.h"
#include "server/import/reader/PlainScene.h"

class SoInput;
class SoProto;
class SbString;

namespace tessera {

/// One thread; one at a time, as Coin's callbacks are the process's. Notes go to the scene.
class CoinFiles {
public:
    /// `path`: of the file that is read.
    CoinFiles(const std::string& path, const ReadLimits& limits, PlainScene& scene);
    ~CoinFiles();
    CoinFiles(const CoinFiles&) = delete;
    CoinFiles& operator=(const CoinFiles&) = delete;

    /// Before the process is confined: Coin itself, and what it loads.
    static void prepare();

    [[nodiscard]] const std::string& folder() const { return folder_.folder(); }
    /// The real path of a file that is named in another one; also that file's bytes. Nothing is fetched.
    [[nodiscard]] Expected<std::string> find(const std::string& name, const std::string& from) const;
    [[nodiscard]] Expected<Bytes> read(const std::string& path) const { return folder_.read(path); }
    /// The scene in a file, by its real path: read once, the same nodes each time. Lives as long as this.
    [[nodiscard]] Expected<SoSeparator*> open(const std::string& path);

    /// Of all that has been opened, unpacked.
    [[nodiscard]] std::size_t textBytes() const { return textBytes_; }

private:
    static SoProto* fetchProto(SoInput* in, const SbString* urls, int count, void* self);
    SoProto* protoOf(const std::string& url, SoInput& into);
    Expected<SoSeparator*> parse(const std::string& path);
    /// Of the file that is being read.
    [[nodiscard]] Expected<CoinText> textOf(ByteSpan bytes) const;

    FolderFiles folder_;
    std::size_t maxBytes_;
    PlainScene& scene_;
    const void* stackBegin_;
    std::size_t textBytes_ = 0;
    std::map<std::string, Expected<SoSeparator*>> opened_;
    std::vector<std::string> problems_;  ///< with prototypes of other files
    std::vector<std::string> reading_;   ///< real paths, the innermost last
};

}  // namespace tessera
