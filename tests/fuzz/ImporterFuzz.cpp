/// What the importing child says to its parent, and the saved objects in it.
#include <sys/mman.h>
#include <unistd.h>

#include "common/base/Hash.h"
#include "common/scene/Aspect.h"
#include "common/scenefile/SavedReader.h"
#include "server/import/ChildProcess.h"
#include "server/import/Record.h"
#include "server/import/SceneFileCheck.h"
#include "tests/fuzz/FuzzInput.h"

namespace tessera::fuzz {
namespace {

void append(Bytes& all, ImportRecord::Kind kind, ByteSpan payload) {
    ImportRecord record;
    record.kind = kind;
    record.sizeBytes = payload.size();
    record.hash = hash64(payload);
    const auto head = std::as_bytes(std::span(&record, 1));
    all.insert(all.end(), head.begin(), head.end());
    all.insert(all.end(), payload.begin(), payload.end());
}

/// Records with the right hashes, or whatever the bytes are.
Bytes records(FuzzInput& in) {
    Bytes all;
    if (in.below(4) == 0) {
        const ByteSpan bytes = in.rest();
        return {bytes.begin(), bytes.end()};
    }
    while (!in.empty()) {
        const auto kind = static_cast<ImportRecord::Kind>(1 + in.below(6));
        append(all, kind, in.bytes(in.number<std::uint16_t>()));
    }
    append(all, ImportRecord::Kind::kEnd, {});
    return all;
}

void run(FuzzInput in) {
    const Bytes said = records(in);
    const int file = memfd_create("importer", MFD_CLOEXEC);
    must(file >= 0 && write(file, said.data(), said.size()) == static_cast<ssize_t>(said.size()),
         "there is memory for a file");
    lseek(file, 0, SEEK_SET);
    ImportOptions options;
    options.maxResultBytes = 1 << 20;
    const Expected<ImporterOutput> output = readImporterOutput(file, options, [] {
        return Error{ErrorCode::kBadInput, "cut short"};
    });
    close(file);
    if (!output) return must(!output.error().message.empty(), "a refusal has words");
    const Expected<proto::scene::SceneFile> content = parseSceneFile(output->scene);
    if (!content || content->saved().empty()) return;
    ChangeListBuilder builder;
    const Expected<SavedScene> saved = readSaved(
        std::as_bytes(std::span(content->saved().data(), content->saved().size())), output->blobs, {}, builder);
    if (!saved) return must(!saved.error().message.empty(), "a refusal has words");
}

}  // namespace
}  // namespace tessera::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::run({data, size});
    return 0;
}
