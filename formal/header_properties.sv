// SPDX-License-Identifier: Apache-2.0
// Of every packet header one wrong bit, whichever, is corrected and told, and two wrong bits are found.
//
// The code is written as the standard has it, the data bits that each check bit covers. What is received is any word,
// what is wrong in it up to two of its 32 bits, such that a code word is left: the code is linear, so that is where both
// have the same parities.

module header_properties (
    input clk,
    input strobe,
    input [31:0] header,
    input first,
    input second,
    input [4:0] first_place,
    input [4:0] second_place
);
  // Parities of a word: of each check bit with its data bits, and the two bits that are zero.
  function [7:0] parities(input [31:0] word);
    integer i;
    begin
      parities = word[31:24];
      for (i = 0; i < 24; i = i + 1) begin
        parities[0] = parities[0] ^ (word[i] & (24'b1111_0001_0010_1100_1011_0111 >> i));
        parities[1] = parities[1] ^ (word[i] & (24'b1111_0010_0101_0101_0101_1011 >> i));
        parities[2] = parities[2] ^ (word[i] & (24'b0111_0100_1001_1010_0110_1101 >> i));
        parities[3] = parities[3] ^ (word[i] & (24'b1011_1000_1110_0011_1000_1110 >> i));
        parities[4] = parities[4] ^ (word[i] & (24'b1101_1111_0000_0011_1111_0000 >> i));
        parities[5] = parities[5] ^ (word[i] & (24'b1110_1111_1111_1100_0000_0000 >> i));
      end
    end
  endfunction

  wire [31:0] wrong = (first ? 32'b1 << first_place : 32'b0) ^ (second ? 32'b1 << second_place : 32'b0);
  wire [1:0] count = (first && second && first_place == second_place) ? 2'd0 : {1'b0, first} + {1'b0, second};

  wire out_strobe, corrected, damaged;
  wire [23:0] out_data;

  header_ecc dut (
      .clk(clk),
      .strobe(strobe),
      .header(header),
      .out_strobe(out_strobe),
      .data(out_data),
      .corrected(corrected),
      .damaged(damaged)
  );

  // What went in two clocks ago: whether it is a code word with those bits wrong, what was sent, how many are wrong.
  reg strobe_1 = 0, strobe_2 = 0;
  reg counts_1 = 0, counts_2 = 0;
  reg [23:0] data_1 = 0, data_2 = 0;
  reg [1:0] count_1 = 0, count_2 = 0;

  always @(posedge clk) begin
    strobe_1 <= strobe;
    counts_1 <= parities(header) == parities(wrong);
    data_1 <= header[23:0] ^ wrong[23:0];
    count_1 <= count;
    strobe_2 <= strobe_1;
    counts_2 <= counts_1;
    data_2 <= data_1;
    count_2 <= count_1;
  end

  always @* begin
    if (strobe_2) assert (out_strobe);
    if (counts_2) begin
      assert (corrected == (count_2 == 1));
      assert (damaged == (count_2 == 2));
      assert (count_2 == 2 || out_data == data_2);
    end
  end
endmodule
