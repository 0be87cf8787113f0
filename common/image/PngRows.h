/// PNG files row by row, for pictures that nobody wants to hold whole.
#pragma once

#include <functional>
#include <memory>

#include "common/image/Picture.h"

namespace tessera {

/// As `decodePng`, which says what is read. `bytes` outlive it.
class PngRowReader {
public:
    [[nodiscard]] static Expected<PngRowReader> open(ByteSpan bytes);
    ~PngRowReader();
    PngRowReader(PngRowReader&& other) noexcept;
    PngRowReader& operator=(PngRowReader&& other) noexcept;

    [[nodiscard]] int widthPx() const;
    [[nodiscard]] int heightPx() const;
    /// The next one from the top, three bytes a pixel. `heightPx` calls at most.
    [[nodiscard]] Expected<void> next(std::uint8_t* rgb);
    /// The number in the text chunk "frame".
    [[nodiscard]] std::optional<std::uint64_t> frame() const;

private:
    struct Impl;
    explicit PngRowReader(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// As `encodePng`, and of any size that PNG has. `sink` is given the file piece by piece.
class PngRowWriter {
public:
    PngRowWriter(int widthPx, int heightPx, std::optional<std::uint64_t> frame,
                 const std::function<void(ByteSpan)>& sink);
    ~PngRowWriter();

    void row(const std::uint8_t* rgb);
    /// Behind the last row.
    void end();

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
