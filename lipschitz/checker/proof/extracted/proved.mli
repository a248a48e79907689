
val negb : bool -> bool

val option_map : ('a1 -> 'a2) -> 'a1 option -> 'a2 option

val fst : ('a1 * 'a2) -> 'a1

val snd : ('a1 * 'a2) -> 'a2

val length : 'a1 list -> int

val app : 'a1 list -> 'a1 list -> 'a1 list

type comparison =
| Eq
| Lt
| Gt

val compOpp : comparison -> comparison

val add : int -> int -> int

val mul : int -> int -> int

val sub : int -> int -> int



val eqb : bool -> bool -> bool

module Nat :
 sig
  val even : int -> bool

  val divmod : int -> int -> int -> int -> int * int

  val div : int -> int -> int

  val div2 : int -> int
 end

module Pos :
 sig
  val succ : Big.t -> Big.t

  val add : Big.t -> Big.t -> Big.t

  val add_carry : Big.t -> Big.t -> Big.t

  val pred_double : Big.t -> Big.t

  val mul : Big.t -> Big.t -> Big.t

  val iter : ('a1 -> 'a1) -> 'a1 -> Big.t -> 'a1

  val div2 : Big.t -> Big.t

  val div2_up : Big.t -> Big.t

  val size : Big.t -> Big.t

  val compare_cont : comparison -> Big.t -> Big.t -> comparison

  val compare : Big.t -> Big.t -> comparison

  val eqb : Big.t -> Big.t -> bool
 end

module Z :
 sig
  val double : Big.t -> Big.t

  val succ_double : Big.t -> Big.t

  val pred_double : Big.t -> Big.t

  val pos_sub : Big.t -> Big.t -> Big.t

  val compare : Big.t -> Big.t -> comparison

  val pos_div_eucl : Big.t -> Big.t -> Big.t * Big.t

  val div_eucl : Big.t -> Big.t -> Big.t * Big.t

  val div2 : Big.t -> Big.t
 end

val hd : 'a1 -> 'a1 list -> 'a1

val tl : 'a1 list -> 'a1 list

val nth : int -> 'a1 list -> 'a1 -> 'a1

val nth_error : 'a1 list -> int -> 'a1 option

val last : 'a1 list -> 'a1 -> 'a1

val concat : 'a1 list list -> 'a1 list

val map : ('a1 -> 'a2) -> 'a1 list -> 'a2 list

val flat_map : ('a1 -> 'a2 list) -> 'a1 list -> 'a2 list

val fold_left : ('a1 -> 'a2 -> 'a1) -> 'a2 list -> 'a1 -> 'a1

val fold_right : ('a2 -> 'a1 -> 'a1) -> 'a1 -> 'a2 list -> 'a1

val existsb : ('a1 -> bool) -> 'a1 list -> bool

val forallb : ('a1 -> bool) -> 'a1 list -> bool

val filter : ('a1 -> bool) -> 'a1 list -> 'a1 list

val combine : 'a1 list -> 'a2 list -> ('a1 * 'a2) list

val firstn : int -> 'a1 list -> 'a1 list

val skipn : int -> 'a1 list -> 'a1 list

val seq : int -> int -> int list

val repeat : 'a1 -> int -> 'a1 list

val dot :
  'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list
  -> 'a1

val apply :
  'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 list list -> 'a1
  list -> 'a1 list

val plus : ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list -> 'a1 list

val scale : ('a1 -> 'a1 -> 'a1) -> 'a1 -> 'a1 list -> 'a1 list

val scale_all : ('a1 -> 'a1 -> 'a1) -> 'a1 -> 'a1 list list -> 'a1 list list

val times : ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list -> 'a1 list

val scale_rows :
  ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list list -> 'a1 list list

val columns : 'a1 -> int -> 'a1 list list -> 'a1 list list

val product :
  'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 list list -> 'a1
  list list -> 'a1 list list

val sum :
  ('a1 -> 'a1 -> 'a1) -> 'a1 list list -> 'a1 list list -> 'a1 list list

val gram :
  'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 list list -> 'a1
  list list

val diagonal_block : 'a1 -> 'a1 list -> 'a1 list list -> 'a1 list list

val diagonal : 'a1 -> 'a1 list -> 'a1 list list

val band :
  'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 -> 'a1 -> 'a1 list
  -> ('a1 list * 'a1 list list) list -> 'a1 list list -> 'a1 list list

val lmi :
  'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 -> 'a1 -> 'a1 ->
  'a1 list -> 'a1 list list -> ('a1 list * 'a1 list list) list -> 'a1 list
  list -> 'a1 list list

type sorting =
| Groups of int
| Halves
| Pairs

type activation =
| Relu
| Tanh
| Sigmoid
| Softplus
| Elu
| Selu
| Silu
| Gelu
| Sorted of sorting
| Keeping of int * activation

val inserted :
  ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 -> 'a1 list -> 'a1 list

val ascending :
  ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list

val sorted_groups :
  ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> int -> int -> 'a1 list -> 'a1
  list

val both : ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list -> 'a1 list

val of_halves : ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list

val of_pairs : ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list

val sorted_by :
  ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> sorting -> 'a1 list -> 'a1
  list

val base : activation -> activation

val by_number :
  (activation -> 'a1 -> 'a2) -> ('a1 -> 'a2) -> activation -> 'a1 list -> 'a2
  list

type 't relation =
| Each of ('t * 't) list
| Grouped of int * int

val spread : int -> 'a1 list -> 'a1 list

val weighted_gram :
  'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list
  list -> 'a1 list list

type 't bent_layer = (('t * 't) list * 't list) * 't list list

val ranges_of : 'a1 bent_layer -> ('a1 * 'a1) list

val multipliers_of : 'a1 bent_layer -> 'a1 list

val sums : ('a1 -> 'a1 -> 'a1) -> ('a1 * 'a1) list -> 'a1 list

val products : ('a1 -> 'a1 -> 'a1) -> ('a1 * 'a1) list -> 'a1 list

val bends :
  'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> int -> 'a1 bent_layer
  list -> 'a1 list list

val weighted :
  ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 bent_layer list -> ('a1
  list * 'a1 list list) list

val bent_lmi :
  'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 -> 'a1 -> 'a1 list
  -> 'a1 bent_layer list -> 'a1 list list -> 'a1 list list

val fitted : 'a1 -> ('a1 -> 'a1 -> 'a1) -> int -> 'a1 list -> 'a1 list

val sum_rows :
  'a1 -> ('a1 -> 'a1 -> 'a1) -> 'a1 -> int -> int -> int -> int -> 'a1 list
  list -> 'a1 list list

type 't pin = ('t list * 't list list) * int

val pins :
  'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> int -> 'a1 pin list ->
  'a1 list list

val dotZ : Big.t list -> Big.t list -> Big.t

val strip : Big.t list -> int * Big.t list

val dot_stripped : (int * Big.t list) -> (int * Big.t list) -> Big.t

val gram_stripped : (int * Big.t list) list -> Big.t list list

val gramZ : Big.t list list -> Big.t list list

type dyadic = Big.t * Big.t

val zero : dyadic

val add0 : dyadic -> dyadic -> dyadic

val mul0 : dyadic -> dyadic -> dyadic

val neg : dyadic -> dyadic

val abs : dyadic -> dyadic

val shift : Big.t -> dyadic -> dyadic

val is_nonnegative : dyadic -> bool

val is_positive : dyadic -> bool

type matrixD = dyadic list list

type factor = { unit0 : Big.t; scales : Big.t list; rows : Big.t list list }

val shift_row : Big.t -> Big.t list -> dyadic list -> dyadic list

val congruence : Big.t list -> matrixD -> matrixD

val remainder : matrixD -> factor -> matrixD

val total : dyadic list -> dyadic

val dominant : matrixD -> dyadic list -> bool

val shows_nonnegative : matrixD -> factor -> bool

val lowest : matrixD -> Big.t

val in_units : Big.t -> dyadic -> Big.t

val gramD : matrixD -> matrixD

val norm_inequality : dyadic -> matrixD -> matrixD

val split : dyadic list -> matrixD list -> dyadic list list

val inputs : matrixD list -> matrixD -> int

val is_zero : dyadic -> bool

type rangeD = dyadic * dyadic

val is_unit_range : rangeD -> bool

type relationD = dyadic relation

val is_unit_relation : relationD -> bool

val is_grouped : relationD -> bool

val multipliers_in : relationD -> matrixD -> int

val multipliers_needed : relationD list -> matrixD list -> int

val groups_fit : relationD list -> matrixD list -> bool

val minus_one : dyadic

val bent_of :
  relationD list -> matrixD list -> dyadic list -> dyadic bent_layer list

val pins_of :
  int -> relationD list -> matrixD list -> dyadic list -> dyadic pin list

val matrix_inequality :
  relationD list -> matrixD list -> matrixD -> dyadic -> dyadic list ->
  matrixD

val shapes : int -> matrixD list -> matrixD -> bool

val check :
  relationD list -> matrixD list -> matrixD -> dyadic -> dyadic -> dyadic
  list -> factor -> bool

type stack = matrixD list * matrixD

type layerD = matrixD * dyadic list

type part = { hidden : layerD list; outer : layerD;
              clamp : (dyadic * dyadic) list; between : activation list }

val no_part : part

val part_at : part list -> int -> part

val layers : part -> layerD list

val inputs_of : part -> int

type function0 =
| Alone of int
| Set_of of int * int

val moved : function0 -> int

val count_of : int -> int list -> int

val same_terms : int list -> int list -> bool

val is_silent : int list list -> int list -> bool

val outputs_of : part -> int

val one : dyadic

type kind = (int * bool list) * Big.t

type box = (dyadic * dyadic) list

type term = { phi : int; inputs_in : box; fewest : Big.t; most : Big.t }

val box_of : (int * box) list -> int -> box option

type claim =
| Norm_at_most of int * int * dyadic
| Norm_at_least of int * int * dyadic
| Slope_at_most of function0 * bool list * dyadic list * dyadic
| Slope_at_least of int list list * function0 * bool list * dyadic list
   * dyadic
| Slope_in_box of function0 * bool list * dyadic list * box * dyadic
| Law of bool * kind list * int * dyadic
| Law_in_box of bool * (kind * box) list * int * dyadic
| Within of int * box * box
| Sum_within of int list list * term list * int * box
| Jump_at_most of int * box * int * dyadic
| Float_error of bool * int * box * dyadic list * dyadic list * dyadic
| Sum_float_error of bool * (term * dyadic list) list * int * dyadic
| Slope_among of int * int * bool list * dyadic list * box * term list
   * dyadic
| Law_among of bool * ((kind * box) * Big.t) list * int * dyadic
| Step_at_most of int list list * (int * box) list * int * int * dyadic

val steepest : activation -> dyadic

val is_rising : activation -> bool

val is_entrywise : activation -> bool

val changes_numbers : activation -> bool

val is_relu : activation -> bool

val range_of : activation -> rangeD

val kept_range : rangeD

val unit_of : activation -> dyadic

val divided_range : activation -> rangeD

val set_stages :
  matrixD list -> matrixD -> matrixD list -> matrixD -> matrixD list * matrixD

val outputs : matrixD list -> int -> int

val check_parts :
  relationD list -> stack -> stack list -> dyadic -> dyadic -> dyadic list ->
  factor -> bool

val count : bool list -> int

val selector : bool list -> dyadic list -> matrixD

val positive_scale : dyadic list -> bool

val reluD : dyadic -> dyadic

val minusD : dyadic list -> dyadic list -> dyadic list

val squareD : dyadic list -> dyadic

type fixed = Big.t * Big.t

val unit_of_fixed : Big.t

val least : Big.t -> Big.t -> Big.t

val greatest : Big.t -> Big.t -> Big.t

val ceil_shift : Big.t -> Big.t -> Big.t

val ceil_quotient : Big.t -> Big.t -> Big.t

val floor_at : Big.t -> dyadic -> Big.t

val ceil_at : Big.t -> dyadic -> Big.t

val floor_to : Big.t -> dyadic -> dyadic

val ceil_to : Big.t -> dyadic -> dyadic

val of_dyadic : dyadic -> fixed

val oneF : fixed

val addF : fixed -> fixed -> fixed

val negF : fixed -> fixed

val mulF : fixed -> fixed -> fixed

val overF : fixed -> Big.t -> fixed

val ratioF : Big.t -> Big.t -> fixed

val divF : fixed -> fixed -> fixed

val exp_series : int -> Big.t -> fixed -> fixed -> fixed -> fixed

val squares : int -> fixed -> fixed

val vanishing : Big.t

val exp_by_series : fixed -> fixed

val exp_of_minus : fixed -> fixed

val at_most : dyadic -> dyadic -> bool

val clampedD : (dyadic * dyadic) list -> dyadic list -> dyadic list

val same : dyadic -> dyadic -> bool

val same_numbers : dyadic list -> dyadic list -> bool

val same_box : box -> box -> bool

val contains : box -> box -> bool

val clamp_ends : (dyadic * dyadic) list -> box -> box

val relu_ends : (dyadic * dyadic) -> dyadic * dyadic

val larger : dyadic -> dyadic -> dyadic

val largest_abs : (dyadic * dyadic) -> dyadic

val row_ends : dyadic list -> box -> dyadic * dyadic

val encloses : matrixD -> dyadic list -> box -> box -> bool

val check_layers : layerD list -> layerD -> box -> box list -> box -> bool

val sizes : box -> dyadic list -> dyadic list

val size0 : 'a1 list -> Big.t

val gammaD : Big.t -> dyadic

val any_rounding : Big.t -> dyadic -> dyadic option

val rounding_fits : Big.t -> dyadic -> dyadic -> dyadic -> bool

val one_rounding : dyadic -> dyadic

val ordered_rounding :
  dyadic list -> box -> (dyadic * dyadic) -> dyadic -> dyadic option

val widened : box -> dyadic list -> box

val layer_roundings :
  bool -> matrixD -> dyadic list -> box -> dyadic list -> dyadic list option

val errors_fit : matrixD -> dyadic list -> dyadic list -> dyadic list -> bool

val norm_fits : dyadic -> dyadic -> dyadic -> dyadic list -> bool

val check_roundings :
  bool -> layerD list -> layerD -> box -> dyadic list -> box list -> dyadic
  list list -> dyadic list -> dyadic list -> dyadic -> dyadic list -> dyadic
  -> bool

val add_ends : Big.t -> Big.t -> box -> box -> box

val sum_fits : Big.t -> dyadic list -> dyadic list -> dyadic list -> bool

val in_words : Big.t list -> Big.t

val inverse_rootF : fixed

val normal_series :
  int -> Big.t -> fixed -> fixed -> fixed -> (Big.t * fixed) * fixed

val halfF : fixed

val densityF : fixed -> fixed

val most_terms : int

val far : Big.t

val probability_of_positive : fixed -> fixed

val probabilityF : dyadic -> fixed

val log_series : int -> Big.t -> fixed -> fixed -> fixed -> fixed

val confirmed_log : Big.t -> Big.t -> fixed -> fixed

val log_of_one_plus : fixed -> fixed

val selu_scaleF : fixed

val selu_alphaF : fixed

val exp_of_minus_size : dyadic -> fixed

val sigmoidF : dyadic -> fixed

val tanhF : dyadic -> fixed

val softplusF : dyadic -> fixed

val eluF : dyadic -> fixed

val seluF : dyadic -> fixed

val value_at : activation -> dyadic -> fixed

val minimum_of : activation -> (dyadic * dyadic) * dyadic

val smaller : dyadic -> dyadic -> dyadic

val below : dyadic -> dyadic -> bool

val values_between : activation -> (dyadic * dyadic) -> dyadic * dyadic

val least_ends : (dyadic * dyadic) -> (dyadic * dyadic) -> dyadic * dyadic

val greatest_ends : (dyadic * dyadic) -> (dyadic * dyadic) -> dyadic * dyadic

val activated_ends : activation -> box -> box

val plus_ends : box -> box -> box

val affine_ends : layerD -> box -> box

val network_ends : activation list -> layerD list -> layerD -> box -> box

val gelu_slopeF : dyadic -> fixed

val bumpF : fixed -> fixed

val is_below_zero : dyadic -> bool

val slope_at : activation -> dyadic -> fixed

val nearest : (dyadic * dyadic) -> dyadic

val farthest : (dyadic * dyadic) -> dyadic

val steepest_place : activation -> dyadic * dyadic

val derivatives : activation -> (dyadic * dyadic) -> dyadic * dyadic

val slopes_between : activation -> (dyadic * dyadic) -> dyadic * dyadic

val half : dyadic -> dyadic

val fits_layer : layerD -> bool

val grid : dyadic

type linear = { slope : dyadic list; middle : dyadic; error : dyadic }

type known = (dyadic * dyadic) * linear

val inputs_known : int -> box -> known list

val radius_of : box -> dyadic list

val rounding_of : dyadic list -> dyadic

val row_form : dyadic list -> known list -> linear

val rounded : dyadic -> linear -> linear

val met : dyadic list -> (dyadic * dyadic) -> linear -> known

val passed :
  dyadic list -> dyadic -> matrixD -> dyadic list -> known list -> known list

val ends_of : activation -> (dyadic * dyadic) -> dyadic * dyadic

val activated_form : activation -> dyadic -> known -> known

val constant_form : (dyadic * dyadic) -> known

val activated_known : activation -> dyadic -> known list -> known list

val contains_known : box -> known list -> bool

val check_centred :
  dyadic list -> dyadic -> activation list -> layerD list -> layerD -> known
  list -> box list -> box -> bool

val check_layers_centred :
  activation list -> layerD list -> layerD -> box -> box list -> box -> bool

type hints = { slope_between : (dyadic -> dyadic -> dyadic);
               rounded_up : (dyadic -> dyadic);
               factor_number : (int -> matrixD -> factor option) }

val up : hints -> dyadic -> dyadic

type line =
| On
| Off
| Open of dyadic * dyadic * dyadic * dyadic

val line_of : hints -> dyadic -> dyadic -> line

val through_relu :
  dyadic list -> line list -> bool list -> dyadic list * dyadic

val combined : dyadic list -> matrixD -> dyadic list

val form_above :
  (layerD * line list) list -> bool list list -> dyadic list -> dyadic ->
  dyadic list * dyadic

val most0 :
  (layerD * line list) list -> bool list list -> dyadic list -> dyadic -> box
  -> dyadic

type decision = { neuron : int; is_on : bool; lower_slopes : bool list list }

val new_line :
  hints -> box -> (layerD * line list) list -> dyadic list -> dyadic -> line
  list -> line

val new_lines :
  hints -> box -> (layerD * line list) list -> matrixD -> dyadic list -> line
  list -> line list

val decide :
  box -> (layerD * line list) list -> matrixD -> dyadic list -> line list ->
  decision -> line list option

val decide_all :
  box -> (layerD * line list) list -> matrixD -> dyadic list -> line list ->
  decision list -> line list option

val bounds :
  hints -> box -> (layerD * line list) list -> layerD list -> line list list
  -> decision list list -> line list list option

type pair_of_forms = dyadic list * dyadic list

val scale_short : dyadic -> dyadic list -> dyadic list

val outer_sum_of : dyadic list -> dyadic list -> matrixD

val quadratic : pair_of_forms list -> matrixD

val half0 : dyadic -> dyadic

val unit_form : int -> dyadic list

val minus_squares : matrixD -> pair_of_forms list

val half_last : dyadic list -> dyadic list

val form_pairs : dyadic -> matrixD -> matrixD -> matrixD -> pair_of_forms list

val is_open : line -> bool

val relu_step :
  line list -> dyadic list -> matrixD -> int -> (pair_of_forms
  list * matrixD) * int

val times_rows : matrixD -> matrixD -> matrixD

val chain_pairs :
  layerD list -> line list list -> dyadic list list -> matrixD -> int ->
  (pair_of_forms list * matrixD) * (matrixD * matrixD) list

type place = { in_layer : int; in_row : int; stays_on : bool }

type conflict = { first : place; second : place; weight : dyadic;
                  rest : dyadic; times_product : dyadic }

val lines_before :
  layerD list -> line list list -> (layerD * line list) list -> int ->
  (layerD * line list) list

val place_is_open : line list list -> place -> bool

val no_layer : layerD

val form_of_place :
  layerD list -> line list list -> place -> dyadic list * dyadic

val is_shown : layerD list -> line list list -> box -> conflict -> bool

val increment_form : (matrixD * matrixD) list -> place -> dyadic list

val conflict_pairs :
  (matrixD * matrixD) list -> conflict list -> pair_of_forms list

val shown_by :
  (int -> matrixD -> factor option) -> int -> int -> matrixD -> bool

val most_factors : int

val input_pairs : dyadic -> int -> pair_of_forms list

val output_pairs : matrixD option -> matrixD -> pair_of_forms list

val part_inequality :
  layerD list -> layerD -> matrixD option -> bool list -> dyadic list ->
  dyadic -> line list list -> conflict list -> dyadic list -> matrixD

val anything : layerD -> line list

val form_inequality : part -> matrixD -> dyadic list -> matrixD

type proved_form = { lower_rows : matrixD; form_multipliers : dyadic list;
                     form_factor : (int -> matrixD -> factor option) }

val check_form : part -> proved_form -> bool

type tree =
| Leaf of decision list list * conflict list * dyadic list
| Halve of decision list list * int * dyadic * tree * tree

val cut : int -> dyadic -> bool -> box -> box

val check_tree :
  hints -> layerD list -> (line list list -> conflict list -> dyadic list ->
  matrixD) -> box -> line list list -> tree -> bool

val widened0 : matrixD -> dyadic list -> matrixD

val homogeneous : int -> layerD list -> layerD list

val is_chain : int -> layerD list -> bool

val face : dyadic list -> int -> dyadic -> box

val all_faces : dyadic list -> box list

val check_trees :
  hints -> layerD list -> (line list list -> conflict list -> dyadic list ->
  matrixD) -> box list -> tree list -> bool

val passing : int -> int -> layerD list -> layerD list

val joined_layer : layerD -> layerD -> layerD

val first_layer : part -> layerD

val term_layer : part -> part -> layerD

val with_units : matrixD -> int -> matrixD

val coupled : part -> part -> dyadic list -> part

type range_tree =
| Range_leaf of decision list list
| Range_halves of decision list list * int * dyadic * range_tree * range_tree

val all_before :
  layerD list -> line list list -> (layerD * line list) list ->
  (layerD * line list) list

val ends_of0 :
  (layerD * line list) list -> matrixD -> dyadic list -> box -> box

val narrowed : box -> box -> box

val check_range :
  hints -> layerD list -> layerD -> box -> line list list -> box -> box ->
  range_tree -> bool

val ends_of_terms : int -> term list -> box list -> box option

val joins : part -> int -> bool

type proof =
| By_inequality of dyadic * dyadic list * factor
| By_vector of dyadic list
| By_product
| By_local_product
| By_local_inequality of dyadic * dyadic list * factor
| By_points of dyadic list * dyadic list * (int * dyadic list) list
| By_triangle
| By_parts of dyadic * proved_form option * hints * tree
| By_all_parts of dyadic * proved_form option * hints * dyadic list
   * tree list
| By_layers of box list
| By_sum of box
| By_norm
| By_roundings of box list * dyadic list list * dyadic * dyadic list * dyadic
| By_rounded_sum of box * dyadic list
| By_steps of box list
| By_parts_among of dyadic * hints * (box * range_tree) list * tree
| By_halves of int * dyadic

val is_nil : 'a1 list -> bool

val matrix_at : part list -> int -> int -> matrixD

val check_norm_below : matrixD -> dyadic -> dyadic list -> bool

val fits_part : part -> bool

val following : activation list -> 'a1 list -> (activation * 'a1) list

val units : activation -> 'a1 list -> dyadic list

val scale_columns : dyadic list -> matrixD -> matrixD

val scaled_matrices :
  dyadic list -> activation list -> layerD list -> layerD -> stack

val matrices : part -> stack

val divided_ranges : activation -> 'a1 list -> rangeD list

val whole_ranges : activation -> 'a1 list -> rangeD list

val relation_by :
  (activation -> matrixD -> rangeD list) -> activation -> matrixD -> relationD

val relations_by :
  (activation -> matrixD -> rangeD list) -> part -> relationD list

val relu_between : part -> bool

val entrywise_between : part -> bool

val chained : activation -> 'a1 list -> bool

val chained_between : part -> bool

val interleaved : 'a1 list -> 'a1 list -> 'a1 list

val by_pairs : 'a1 list -> 'a1 list

val turned : 'a1 list -> 'a1 list

val turned_if : bool -> 'a1 list list -> 'a1 list list

val regrouped_layers :
  bool -> activation list -> layerD list -> layerD -> activation
  list * (layerD list * layerD)

val regrouped : part -> part

val turns_fit : activation list -> layerD list -> layerD -> bool

val may_regroup : part -> bool

val parts_of : part list -> function0 -> part list

val well_formed : part list -> function0 -> bool list -> dyadic list -> bool

val check_slope :
  part list -> function0 -> bool list -> dyadic list -> dyadic -> dyadic ->
  dyadic list -> factor -> bool

val find_norm : claim list -> int -> int -> dyadic option

val norms : claim list -> int -> int -> layerD list -> dyadic option

val with_slopes : activation list -> 'a1 list -> dyadic -> dyadic

val norm_of : part list -> claim list -> int -> dyadic option

val largest : dyadic -> dyadic list -> dyadic

val behind_of : part list -> claim list -> function0 -> dyadic option

val check_product_with :
  part list -> claim list -> function0 -> bool list -> dyadic list -> dyadic
  -> dyadic option -> bool

val check_product :
  part list -> claim list -> function0 -> bool list -> dyadic list -> dyadic
  -> bool

val steepest_known : activation -> known list -> dyadic

val steepest_centred :
  dyadic list -> dyadic -> activation list -> layerD list -> known list ->
  dyadic

val steepest_on_box : part -> box -> dyadic

val check_local_product :
  part list -> claim list -> function0 -> bool list -> dyadic list -> box ->
  dyadic -> bool

val slopes_known : activation -> known list -> rangeD list

val ranges_centred :
  dyadic list -> dyadic -> activation list -> layerD list -> known list ->
  rangeD list list

val ranges_on_box : part -> box -> rangeD list list

val local_relations : part list -> function0 -> box -> relationD list list

val undivided_matrices : part -> stack

val check_local_slope :
  part list -> function0 -> bool list -> dyadic list -> box -> dyadic ->
  dyadic -> dyadic list -> factor -> bool

val check_parts_with :
  part list -> function0 -> bool list -> dyadic list -> dyadic -> dyadic ->
  proved_form option -> (matrixD option -> bool) -> bool

val check_parts_of_box :
  part list -> function0 -> bool list -> dyadic list -> box -> dyadic ->
  dyadic -> proved_form option -> hints -> tree -> bool

val check_parts_of_all :
  part list -> function0 -> bool list -> dyadic list -> dyadic -> dyadic ->
  proved_form option -> hints -> dyadic list -> tree list -> bool

val check_term_range :
  part list -> int -> hints -> term -> (box * range_tree) -> bool

val check_term_ranges :
  part list -> int -> hints -> term list -> (box * range_tree) list -> bool

val check_slope_among :
  part list -> int -> int -> bool list -> dyadic list -> box -> term list ->
  dyadic -> dyadic -> hints -> (box * range_tree) list -> tree -> bool

val value_ends : part -> box -> box

val value_of_ends : part list -> function0 -> box -> box -> box

val at_point : dyadic list -> box

val least_square : box -> box -> dyadic

val agreeD : bool list -> dyadic list -> dyadic list -> bool

val fraction_in : dyadic list -> dyadic list -> dyadic * dyadic

val check_points :
  part list -> int list list -> function0 -> bool list -> dyadic list ->
  dyadic -> dyadic list -> dyadic list -> (int * dyadic list) list -> bool

val same_moves : bool list -> bool list -> bool

val find_slope : claim list -> int -> int -> bool list -> dyadic option

val total_of : claim list -> bool -> kind list -> int -> dyadic option

val check_law :
  part list -> claim list -> bool -> kind list -> int -> dyadic -> bool

val less_of : dyadic -> dyadic option -> dyadic option

val find_slope_in :
  claim list -> int -> int -> bool list -> box -> dyadic option

val total_in : claim list -> bool -> (kind * box) list -> int -> dyadic option

val check_law_in_box :
  part list -> claim list -> bool -> (kind * box) list -> int -> dyadic ->
  bool

val term_among : Big.t -> ((kind * box) * Big.t) -> term

val others_of :
  ((kind * box) * Big.t) list -> ((kind * box) * Big.t) ->
  ((kind * box) * Big.t) list -> term list

val same_terms_in_boxes : term list -> term list -> bool

val may_be_there : term -> bool

val find_slope_among :
  claim list -> int -> int -> bool list -> box -> term list -> dyadic option

val total_among :
  claim list -> bool -> ((kind * box) * Big.t) list -> ((kind * box) * Big.t)
  list -> int -> dyadic option

val check_law_among :
  part list -> claim list -> bool -> ((kind * box) * Big.t) list -> int ->
  dyadic -> bool

val same_function : function0 -> function0 -> bool

val has_slope_in :
  claim list -> function0 -> bool list -> dyadic list -> box -> dyadic -> bool

val check_halves :
  part list -> claim list -> function0 -> bool list -> dyadic list -> box ->
  dyadic -> int -> dyadic -> bool

val find_within : claim list -> int -> box -> box option

val find_error :
  bool -> claim list -> int -> box -> dyadic list -> (dyadic list * dyadic)
  option

val find_alone : claim list -> int -> int -> dyadic option

val sum_ends : claim list -> int -> term list -> box option

val check_within : part list -> int -> box -> box list -> box -> bool

val number_of : (term -> Big.t) -> int -> term list -> Big.t

val times_in : int -> int list -> Big.t

val may_be_silent : int list list -> term list -> bool

val choices_of : int -> term -> int list list

val all_choices : int -> term list -> int list list

val always_silent : int list list -> term list -> bool

val check_sum_within :
  part list -> claim list -> int list list -> term list -> int -> box -> box
  -> bool

val check_jump :
  part list -> claim list -> int -> box -> int -> dyadic -> bool

val find_jump : claim list -> int -> box -> int -> dyadic option

val without : int -> int list -> int list

val beside : int list list -> int -> int list list

val terms_of : (int * box) list -> int list -> term list option

val check_value_among :
  part list -> claim list -> (int * box) list -> int -> dyadic -> int list ->
  box -> bool

val check_all_among :
  part list -> claim list -> (int * box) list -> int -> dyadic -> int list
  list -> box list -> bool

val check_step :
  part list -> claim list -> int list list -> (int * box) list -> int -> int
  -> dyadic -> box list -> bool

val list_norms : claim list -> int -> int -> layerD list -> dyadic list option

val unclamped_slope : part list -> claim list -> int -> dyadic option

val check_error :
  part list -> claim list -> bool -> int -> box -> dyadic list -> dyadic list
  -> dyadic -> box list -> dyadic list list -> dyadic -> dyadic list ->
  dyadic -> bool

val sum_errors :
  bool -> claim list -> int -> (term * dyadic list) list -> ((Big.t * dyadic
  list) * dyadic list) option

val check_sum_error :
  part list -> claim list -> bool -> (term * dyadic list) list -> int ->
  dyadic -> box -> dyadic list -> bool

val check_claim : part list -> claim list -> claim -> proof -> bool

val step : part list -> claim list -> claim -> proof -> claim list option
