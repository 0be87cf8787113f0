/// What Coin reads a file's bytes through.
#pragma once

#include <Inventor/SoInput.h>

#include <string>
#include <string_view>
#include <vector>

namespace tessera {

/// Coin believes what a file says: it takes memory for as many values as are announced, and goes down as deep as nodes
/// are nested. This one looks at numbers and at the stack first, and says that the file ends where they cannot be.
class CoinInput : public SoInput {
public:
    /// `bytes` stay where they are. `stackBegin`: a frame that all that reads is called from.
    CoinInput(std::string_view bytes, const void* stackBegin);

    /// What could not be; empty: nothing was.
    [[nodiscard]] const std::string& problem() const { return problem_; }

    using SoInput::read;
    SbBool read(SbName& name, SbBool isIdentifier) override;
    SbBool read(SbString& text) override;
    SbBool read(short& number) override;
    SbBool read(int& number) override;
    SbBool readBinaryArray(unsigned char* to, int length) override;
    SbBool readBinaryArray(int32_t* to, int length) override;
    SbBool readBinaryArray(float* to, int length) override;
    SbBool readBinaryArray(double* to, int length) override;

private:
    [[nodiscard]] std::size_t bytesLeft() const;
    /// FALSE: the stack is used up.
    [[nodiscard]] SbBool hasStack();
    /// FALSE: there are not so many left.
    [[nodiscard]] SbBool hasBytes(int length, std::size_t each);
    SbBool refuse(std::string why);

    std::size_t size_;
    const char* stackBegin_;
    std::vector<short> sides_;  ///< numbers that came last and may be those of a picture, flat or solid
    std::string problem_;
};

}  // namespace tessera
