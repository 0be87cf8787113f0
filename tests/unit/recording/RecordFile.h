/// Recordings taken apart and put together again, with hashes that fit.
#pragma once

#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "server/sim/recording/RecordingFormat.h"
#include "tests/unit/TestFolder.h"
#include "tests/unit/recording/RandomShow.h"

namespace tessera::test {

struct RawRecord {
    std::uint64_t kind = 0;
    Bytes content;
};

inline Bytes readBytes(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    const ByteSpan bytes = asBytes(text);
    return {bytes.begin(), bytes.end()};
}
inline void writeBytes(const std::string& path, ByteSpan bytes) {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

/// Of a whole, undamaged file.
inline std::vector<RawRecord> takeApart(ByteSpan file) {
    std::vector<RawRecord> records;
    ByteSpan rest = file.subspan(kRecordingMark.size());
    while (!rest.empty()) {
        RecordHeader header;
        std::memcpy(&header, rest.data(), sizeof(header));
        const ByteSpan content = rest.subspan(sizeof(header), header.bytes);
        records.push_back({header.kind, Bytes(content.begin(), content.end())});
        rest = rest.subspan(sizeof(header) + header.bytes);
    }
    return records;
}
inline Bytes putTogether(const std::vector<RawRecord>& records) {
    const ByteSpan mark = asBytes(kRecordingMark);
    Bytes file(mark.begin(), mark.end());
    for (std::size_t i = 0; i < records.size(); ++i) {
        const RecordHeader header = headerFor(records[i].kind, records[i].content, i);
        const ByteSpan head = std::as_bytes(std::span(&header, 1));
        file.insert(file.end(), head.begin(), head.end());
        file.insert(file.end(), records[i].content.begin(), records[i].content.end());
    }
    return file;
}
inline RawRecord rawOf(const RecordContent& content) {
    const ByteSpan bytes = content.bytes();
    return {content.kind, Bytes(bytes.begin(), bytes.end())};
}

/// A recording of a random show.
struct Recorded {
    Bytes file;
    std::vector<FrameDigest> digests;
    std::uint64_t contacts = 0, refused = 0, shownInParts = 0;
};
inline Recorded recordShow(Random& random, std::uint64_t frames) {
    const TestFolder folder;
    Log log("unit_recording");
    Recorded recorded;
    {
        Expected<std::unique_ptr<RecordingWriter>> writer =
            RecordingWriter::create(folder / "show.rec", openingForTests(), log);
        if (!writer) throw std::runtime_error(writer.error().message);
        RandomShow show(random);
        recorded.digests = show.record(**writer, frames);
        recorded.contacts = show.contacts();
        recorded.refused = show.refused();
        recorded.shownInParts = show.shownInParts();
    }
    recorded.file = readBytes(folder / "show.rec");
    return recorded;
}

}  // namespace tessera::test
