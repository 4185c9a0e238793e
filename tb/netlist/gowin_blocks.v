// SPDX-License-Identifier: Apache-2.0
// Models of the GW2A's hard blocks that Yosys has none of, for its netlists: PLL, divider, serialiser (as hdl/sim/gw2a,
// from the same documents), block RAM (UG285), multiplier (UG287). Enough for what the board uses.
// It stands in front of Yosys' own file, whose modules of the same names are empty.
`timescale 1ps / 1ps

// 27 MHz * 14 / 3 alone.
module rPLL (
  input CLKIN, CLKFB, RESET, RESET_P, input [5:0] FBDSEL, IDSEL, ODSEL, input [3:0] DUTYDA, PSDA, FDLY,
  output reg CLKOUT, output CLKOUTP, CLKOUTD, CLKOUTD3, output reg LOCK
);
  parameter FCLKIN = "27";
  parameter IDIV_SEL = 0;
  parameter FBDIV_SEL = 0;
  parameter ODIV_SEL = 8;
  parameter DEVICE = "GW2A-18C";
  assign CLKOUTP = 0;
  assign CLKOUTD = 0;
  assign CLKOUTD3 = 0;

  initial begin
    CLKOUT = 0;
    LOCK = 0;
    if (IDIV_SEL != 2 || FBDIV_SEL != 13) begin
      $display("rPLL: ratios that the model does not know");
      $finish(0);
    end
    repeat (32) @(posedge CLKIN);
    LOCK = 1;
  end

  // Half a period, 3968 ps, for ever.
  always #3968 CLKOUT = ~CLKOUT;
endmodule

module CLKDIV (input HCLKIN, RESETN, CALIB, output reg CLKOUT);
  parameter DIV_MODE = "2";
  parameter GSREN = "false";
  reg [2:0] cycle = 0;
  initial CLKOUT = 0;

  always @(posedge HCLKIN or negedge RESETN)
    if (!RESETN) begin
      cycle <= 0;
      CLKOUT <= 0;
    end else begin
      cycle <= cycle == 4 ? 0 : cycle + 1;
      if (cycle == 0) CLKOUT <= 1;
      else if (cycle == 2) CLKOUT <= 0;
    end
endmodule

module OSER10 (input D9, D8, D7, D6, D5, D4, D3, D2, D1, D0, FCLK, PCLK, RESET, output Q);
  parameter GSREN = "false";
  parameter LSREN = "true";
  reg [9:0] taken = 0, rest = 0;
  reg seen = 0, fresh = 0;
  assign Q = FCLK ? rest[0] : rest[1];

  always @(posedge PCLK) taken <= {D9, D8, D7, D6, D5, D4, D3, D2, D1, D0};

  always @(negedge FCLK) begin
    seen <= PCLK;
    fresh <= PCLK & ~seen;
  end

  always @(posedge FCLK)
    if (RESET) rest <= 0;
    else rest <= fresh ? taken : rest >> 2;
endmodule

// Unsigned or signed product without registers.
module MULT18X18 (
  input [17:0] A, SIA, B, SIB, input ASIGN, BSIGN, ASEL, BSEL, CE, CLK, RESET, output [35:0] DOUT,
  output [17:0] SOA, SOB
);
  wire signed [36:0] a = {{19{ASIGN & A[17]}}, A};
  wire signed [36:0] b = {{19{BSIGN & B[17]}}, B};
  wire signed [36:0] product = a * b;
  assign DOUT = product[35:0];
  assign SOA = A;
  assign SOB = B;
endmodule

// What a memory of 18 Kbit begins with, first in the low bits.
`define CONTENTS_OF_MEMORY \
  parameter [287:0] INIT_RAM_00 = 288'h0; \
  parameter [287:0] INIT_RAM_01 = 288'h0; \
  parameter [287:0] INIT_RAM_02 = 288'h0; \
  parameter [287:0] INIT_RAM_03 = 288'h0; \
  parameter [287:0] INIT_RAM_04 = 288'h0; \
  parameter [287:0] INIT_RAM_05 = 288'h0; \
  parameter [287:0] INIT_RAM_06 = 288'h0; \
  parameter [287:0] INIT_RAM_07 = 288'h0; \
  parameter [287:0] INIT_RAM_08 = 288'h0; \
  parameter [287:0] INIT_RAM_09 = 288'h0; \
  parameter [287:0] INIT_RAM_0A = 288'h0; \
  parameter [287:0] INIT_RAM_0B = 288'h0; \
  parameter [287:0] INIT_RAM_0C = 288'h0; \
  parameter [287:0] INIT_RAM_0D = 288'h0; \
  parameter [287:0] INIT_RAM_0E = 288'h0; \
  parameter [287:0] INIT_RAM_0F = 288'h0; \
  parameter [287:0] INIT_RAM_10 = 288'h0; \
  parameter [287:0] INIT_RAM_11 = 288'h0; \
  parameter [287:0] INIT_RAM_12 = 288'h0; \
  parameter [287:0] INIT_RAM_13 = 288'h0; \
  parameter [287:0] INIT_RAM_14 = 288'h0; \
  parameter [287:0] INIT_RAM_15 = 288'h0; \
  parameter [287:0] INIT_RAM_16 = 288'h0; \
  parameter [287:0] INIT_RAM_17 = 288'h0; \
  parameter [287:0] INIT_RAM_18 = 288'h0; \
  parameter [287:0] INIT_RAM_19 = 288'h0; \
  parameter [287:0] INIT_RAM_1A = 288'h0; \
  parameter [287:0] INIT_RAM_1B = 288'h0; \
  parameter [287:0] INIT_RAM_1C = 288'h0; \
  parameter [287:0] INIT_RAM_1D = 288'h0; \
  parameter [287:0] INIT_RAM_1E = 288'h0; \
  parameter [287:0] INIT_RAM_1F = 288'h0; \
  parameter [287:0] INIT_RAM_20 = 288'h0; \
  parameter [287:0] INIT_RAM_21 = 288'h0; \
  parameter [287:0] INIT_RAM_22 = 288'h0; \
  parameter [287:0] INIT_RAM_23 = 288'h0; \
  parameter [287:0] INIT_RAM_24 = 288'h0; \
  parameter [287:0] INIT_RAM_25 = 288'h0; \
  parameter [287:0] INIT_RAM_26 = 288'h0; \
  parameter [287:0] INIT_RAM_27 = 288'h0; \
  parameter [287:0] INIT_RAM_28 = 288'h0; \
  parameter [287:0] INIT_RAM_29 = 288'h0; \
  parameter [287:0] INIT_RAM_2A = 288'h0; \
  parameter [287:0] INIT_RAM_2B = 288'h0; \
  parameter [287:0] INIT_RAM_2C = 288'h0; \
  parameter [287:0] INIT_RAM_2D = 288'h0; \
  parameter [287:0] INIT_RAM_2E = 288'h0; \
  parameter [287:0] INIT_RAM_2F = 288'h0; \
  parameter [287:0] INIT_RAM_30 = 288'h0; \
  parameter [287:0] INIT_RAM_31 = 288'h0; \
  parameter [287:0] INIT_RAM_32 = 288'h0; \
  parameter [287:0] INIT_RAM_33 = 288'h0; \
  parameter [287:0] INIT_RAM_34 = 288'h0; \
  parameter [287:0] INIT_RAM_35 = 288'h0; \
  parameter [287:0] INIT_RAM_36 = 288'h0; \
  parameter [287:0] INIT_RAM_37 = 288'h0; \
  parameter [287:0] INIT_RAM_38 = 288'h0; \
  parameter [287:0] INIT_RAM_39 = 288'h0; \
  parameter [287:0] INIT_RAM_3A = 288'h0; \
  parameter [287:0] INIT_RAM_3B = 288'h0; \
  parameter [287:0] INIT_RAM_3C = 288'h0; \
  parameter [287:0] INIT_RAM_3D = 288'h0; \
  parameter [287:0] INIT_RAM_3E = 288'h0; \
  parameter [287:0] INIT_RAM_3F = 288'h0; \
  reg [18431:0] begin_with = { \
    INIT_RAM_3F, INIT_RAM_3E, INIT_RAM_3D, INIT_RAM_3C, INIT_RAM_3B, INIT_RAM_3A, INIT_RAM_39, INIT_RAM_38, \
    INIT_RAM_37, INIT_RAM_36, INIT_RAM_35, INIT_RAM_34, INIT_RAM_33, INIT_RAM_32, INIT_RAM_31, INIT_RAM_30, \
    INIT_RAM_2F, INIT_RAM_2E, INIT_RAM_2D, INIT_RAM_2C, INIT_RAM_2B, INIT_RAM_2A, INIT_RAM_29, INIT_RAM_28, \
    INIT_RAM_27, INIT_RAM_26, INIT_RAM_25, INIT_RAM_24, INIT_RAM_23, INIT_RAM_22, INIT_RAM_21, INIT_RAM_20, \
    INIT_RAM_1F, INIT_RAM_1E, INIT_RAM_1D, INIT_RAM_1C, INIT_RAM_1B, INIT_RAM_1A, INIT_RAM_19, INIT_RAM_18, \
    INIT_RAM_17, INIT_RAM_16, INIT_RAM_15, INIT_RAM_14, INIT_RAM_13, INIT_RAM_12, INIT_RAM_11, INIT_RAM_10, \
    INIT_RAM_0F, INIT_RAM_0E, INIT_RAM_0D, INIT_RAM_0C, INIT_RAM_0B, INIT_RAM_0A, INIT_RAM_09, INIT_RAM_08, \
    INIT_RAM_07, INIT_RAM_06, INIT_RAM_05, INIT_RAM_04, INIT_RAM_03, INIT_RAM_02, INIT_RAM_01, INIT_RAM_00};

module SPX9 (output [35:0] DO, input [35:0] DI, input [2:0] BLKSEL, input [13:0] AD, input WRE, CLK, CE, OCE, RESET);
  `CONTENTS_OF_MEMORY
  parameter READ_MODE = 1'b0;
  parameter WRITE_MODE = 2'b00;
  parameter BIT_WIDTH = 36;
  parameter BLK_SEL = 3'b000;
  parameter RESET_MODE = "SYNC";
  localparam SHIFT = BIT_WIDTH == 36 ? 5 : BIT_WIDTH == 18 ? 4 : 3;
  // Bytes of nine bits.
  reg [8:0] memory [0:2047];
  reg [35:0] word = 0, behind = 0;
  wire [10:0] place = (AD >> SHIFT) * (BIT_WIDTH / 9);
  integer i;
  assign DO = READ_MODE ? behind : word;

  initial for (i = 0; i < 2048; i = i + 1) memory[i] = begin_with[9 * i +: 9];

  // What is read while a word is written: what was read before (00), the new word (01), the old one (10).
  always @(posedge CLK) begin
    if (CE) begin
      for (i = 0; i < BIT_WIDTH / 9; i = i + 1) begin
        if (!WRE || WRITE_MODE == 2) word[9 * i +: 9] <= memory[place + i];
        else if (WRITE_MODE == 1) word[9 * i +: 9] <= DI[9 * i +: 9];
        if (WRE && (BIT_WIDTH == 9 || AD[i])) memory[place + i] <= DI[9 * i +: 9];
      end
    end
    if (RESET) word <= 0;
    if (OCE) behind <= RESET ? 0 : word;
  end
endmodule

module SDPX9B (input CLKA, CEA, CLKB, CEB, OCE, RESETA, RESETB, input [13:0] ADA, ADB, input [2:0] BLKSELA, BLKSELB, input [35:0] DI, output [35:0] DO);
  `CONTENTS_OF_MEMORY
  parameter READ_MODE = 1'b0;
  parameter BIT_WIDTH_0 = 36;
  parameter BIT_WIDTH_1 = 36;
  parameter BLK_SEL_0 = 3'b000;
  parameter BLK_SEL_1 = 3'b000;
  parameter RESET_MODE = "SYNC";
  localparam SHIFT_0 = BIT_WIDTH_0 == 36 ? 5 : BIT_WIDTH_0 == 18 ? 4 : 3;
  localparam SHIFT_1 = BIT_WIDTH_1 == 36 ? 5 : BIT_WIDTH_1 == 18 ? 4 : 3;
  // Bytes of nine bits.
  reg [8:0] memory [0:2047];
  reg [35:0] word = 0, behind = 0;
  wire [10:0] written = (ADA >> SHIFT_0) * (BIT_WIDTH_0 / 9);
  wire [10:0] place = (ADB >> SHIFT_1) * (BIT_WIDTH_1 / 9);
  integer i;
  assign DO = READ_MODE ? behind : word;

  initial for (i = 0; i < 2048; i = i + 1) memory[i] = begin_with[9 * i +: 9];

  // Both clocks are one; a word that is written is read as it was.
  always @(posedge CLKA) begin
    if (CEB)
      for (i = 0; i < BIT_WIDTH_1 / 9; i = i + 1) word[9 * i +: 9] <= memory[place + i];
    if (RESETB) word <= 0;
    if (OCE) behind <= RESETB ? 0 : word;
    if (CEA)
      for (i = 0; i < BIT_WIDTH_0 / 9; i = i + 1)
        if (BIT_WIDTH_0 == 9 || ADA[i]) memory[written + i] <= DI[9 * i +: 9];
  end
endmodule
