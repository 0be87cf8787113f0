/// The sentences that people read, as tests see them: each stands once, in tests/data/words/PROGRAM.txt.
///
/// A test asserts codes, fields and places itself, and leaves the sentence to that file. The file has a section for
/// each test, with a line for each sentence in the order in which the test reads them. Paths of this machine, folders
/// of a test's own and ports that the system chose stand there by their kind. With `TESSERA_WORDS=write` a test that
/// passes writes its section anew.
#pragma once

#include <gtest/gtest.h>

#include <string_view>

namespace tessera::test {

/// Whether `text` is the next sentence of the running test. For the thread that runs the tests.
[[nodiscard]] testing::AssertionResult isNextSentence(std::string_view text);

}  // namespace tessera::test

#define EXPECT_WORDS(text) EXPECT_TRUE(tessera::test::isNextSentence(text))
