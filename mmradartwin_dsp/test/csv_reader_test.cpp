#include "mmradartwin_dsp/csv_reader.h"

#include <gtest/gtest.h>

#include "test_radar.h"

namespace mmradartwin {
namespace {

using Fields = std::vector<std::string>;

TEST(CsvReader, FieldsAreTrimmedAndEmptyLinesLeftOut) {
  CsvReader reader("\xEF\xBB\xBFname, size_m\r\n\n a b ,+1.5e1\r\n  \n,-2", "list.csv");
  EXPECT_EQ(reader.columns(), (Fields{"name", "size_m"}));
  reader.requireColumns("name,size_m");
  ASSERT_TRUE(reader.next());
  EXPECT_EQ(reader.fields(), (Fields{"a b", "+1.5e1"}));
  EXPECT_EQ(reader.number(1), 15);
  ASSERT_TRUE(reader.next());
  EXPECT_EQ(reader.fields(), (Fields{"", "-2"}));
  EXPECT_EQ(reader.number(1), -2);
  EXPECT_EQ(std::string("list.csv: line 5: wrong"), reader.error("wrong").what());
  EXPECT_FALSE(reader.next());
}

TEST(CsvReader, RefusesAnotherHeader) {
  for (const char* text : {"", "name\n", "size_m,name\n", "name,size_m,\n"}) {
    const CsvReader reader(text, "list.csv");
    EXPECT_TRUE(saysInOneLine(inputError([&] { reader.requireColumns("name,size_m"); }), "list.csv: line 1: header",
                              "it must be name,size_m"))
        << text;
  }
}

TEST(CsvReader, RefusesARowOfMoreOrFewerFields) {
  for (const auto& [row, count] : {std::pair{"a", "1 fields"}, {"a,1,", "3 fields"}, {"a,1,2", "3 fields"}}) {
    CsvReader reader(std::string("name,size_m\nb,1\n") + row + "\n", "list.csv");
    ASSERT_TRUE(reader.next());
    EXPECT_TRUE(
        saysInOneLine(inputError([&] { reader.next(); }), "list.csv: line 3:", count, "a row has 2, name,size_m"))
        << row;
  }
}

TEST(CsvReader, NamesColumnAndTextOfWhatIsNoNumber) {
  CsvReader reader("name,size_m\na,1 m\nb,inf\nc,\n", "list.csv");
  ASSERT_TRUE(reader.next());
  EXPECT_TRUE(saysInOneLine(inputError([&] { reader.number(1); }), "list.csv: line 2: size_m '1 m' is no number"));
  ASSERT_TRUE(reader.next());
  reader.callRow("box 'b'");
  EXPECT_TRUE(saysInOneLine(inputError([&] { reader.number(1); }), "list.csv: line 3: box 'b': size_m is inf"));
  ASSERT_TRUE(reader.next());
  EXPECT_TRUE(saysInOneLine(inputError([&] { reader.number(1); }), "list.csv: line 4: size_m '' is no number"));
}

}  // namespace
}  // namespace mmradartwin
