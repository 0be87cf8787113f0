#include "server/import/reader/MappedFile.h"

#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>

#include "common/confine/Confinement.h"
#include "common/confine/OrdinaryFile.h"
#include "server/import/reader/FolderFiles.h"
#include "server/import/reader/ReadProgress.h"

namespace tessera {

Expected<MappedFile> MappedFile::open(const std::string& path, std::size_t maxBytes) {
    isLookedFor(path);
    const Expected<OrdinaryFile> file = openOrdinaryFile(path);
    if (!file) return tl::unexpected(file.error());
    if (file->bytes > maxBytes) return fail(ErrorCode::kLimit, fmt::format("is larger than {} MiB", maxBytes >> 20));
    const auto size = static_cast<std::size_t>(file->bytes);
    if (size == 0) return MappedFile(nullptr, 0);
    void* const data = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file->handle.get(), 0);
    if (data == MAP_FAILED) {
        if (errno == ENOMEM) throw std::bad_alloc();
        return fail(ErrorCode::kBadInput, fmt::format("cannot be read ({})", std::strerror(errno)));
    }
    grantTimeFor(size);
    return MappedFile(data, size);
}

void MappedFile::passed(std::size_t bytes) const {
    constexpr std::size_t kPage = 4096;
    if (data_ != nullptr) (void)::madvise(data_, std::min(bytes, size_) / kPage * kPage, MADV_DONTNEED);
    sayProgress(bytes, size_);
}

void MappedFile::close() {
    if (data_ != nullptr) ::munmap(data_, size_);
    data_ = nullptr;
    size_ = 0;
}

}  // namespace tessera
