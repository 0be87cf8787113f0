#include "server/import/coin/CoinInput.h"

#include <Inventor/SbName.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <utility>

namespace tessera {
namespace {

/// Half of what a process has.
constexpr std::ptrdiff_t kMostStack = std::ptrdiff_t{4} << 20;
/// In bytes, a value takes four at least. Numbers that are none of values may be as large in any file.
constexpr std::size_t kValueBytes = 4, kManyInAny = 65536;

}  // namespace

CoinInput::CoinInput(std::string_view bytes, const void* stackBegin)
    : size_(bytes.size()), stackBegin_(static_cast<const char*>(stackBegin)) {
    setBuffer(bytes.data(), bytes.size());
}

SbBool CoinInput::refuse(std::string why) {
    if (problem_.empty()) problem_ = std::move(why);
    return FALSE;
}

std::size_t CoinInput::bytesLeft() const {
    return size_ - std::min(size_, getNumBytesRead());
}

SbBool CoinInput::hasStack() {
    sides_.clear();
    const auto* const here = static_cast<const char*>(__builtin_frame_address(0));
    if (problem_.empty() && std::abs(stackBegin_ - here) <= kMostStack) return TRUE;
    return refuse("its nodes are nested too deeply");
}

SbBool CoinInput::hasBytes(int length, std::size_t each) {
    if (length != 1) sides_.clear();  // in bytes a side is one, too
    if (!isBinary() || length < 0 || static_cast<std::size_t>(length) <= bytesLeft() / each) return TRUE;
    return refuse(fmt::format("it announces {} values where {} bytes are left: it is cut off, or its count is wrong",
                              length, bytesLeft()));
}

SbBool CoinInput::read(SbName& name, SbBool isIdentifier) {
    return hasStack() && SoInput::read(name, isIdentifier);
}

SbBool CoinInput::read(SbString& text) {
    return hasStack() && SoInput::read(text);
}

SbBool CoinInput::read(short& number) {
    // Coin reads as many digits, and cuts what does not fit.
    int read = 0;
    if (!SoInput::read(read)) return FALSE;
    number = static_cast<short>(read);
    if (number != read)
        return refuse(fmt::format("it has the number {} where none beyond {} fits: a side of a picture is too long",
                                  read, std::numeric_limits<short>::max()));
    constexpr std::size_t kMostSides = 3;
    if (sides_.size() == kMostSides) sides_.erase(sides_.begin());
    sides_.push_back(number);
    return TRUE;
}

SbBool CoinInput::read(int& number) {
    if (!SoInput::read(number)) return FALSE;
    const std::vector<short> sides = std::exchange(sides_, {});
    if (sides.size() > 1 && number > 0 && std::ranges::all_of(sides, [](short side) { return side > 0; })) {
        // Behind a picture's sides comes how many channels it has. In text a pixel is a digit and a blank.
        double pixels = 1;
        for (const short side : sides) pixels *= side;
        if ((isBinary() ? pixels * number : 2 * pixels - 1) > static_cast<double>(bytesLeft()))
            return refuse(
                fmt::format("it announces a picture of {} pixels where {} bytes are left: it is cut off, or "
                            "its size is wrong",
                            fmt::join(sides, " × "), bytesLeft()));
    }
    if (isBinary() && number > 0 && static_cast<std::size_t>(number) > std::max(kManyInAny, size_ / kValueBytes))
        return refuse(fmt::format("it announces {} values in a file of {} bytes: its count is wrong", number, size_));
    return TRUE;
}

SbBool CoinInput::readBinaryArray(unsigned char* to, int length) {
    return hasBytes(length, sizeof(*to)) && SoInput::readBinaryArray(to, length);
}

SbBool CoinInput::readBinaryArray(int32_t* to, int length) {
    return hasBytes(length, sizeof(*to)) && SoInput::readBinaryArray(to, length);
}

SbBool CoinInput::readBinaryArray(float* to, int length) {
    return hasBytes(length, sizeof(*to)) && SoInput::readBinaryArray(to, length);
}

SbBool CoinInput::readBinaryArray(double* to, int length) {
    return hasBytes(length, sizeof(*to)) && SoInput::readBinaryArray(to, length);
}

}  // namespace tessera
