(* ONNX operators as affine maps of their input, with the shapes of their results; every shape is that of one input, so
   the size of the batch is 1. *)

open Enclosed
open Onnx_model

let most_rows = 1 lsl 20
let most_window_entries = 1 lsl 23
let too_large what = raise (Folding.Too_large what)

let shown_shape shape = "[" ^ String.concat ", " (List.map string_of_int shape) ^ "]"
let last shape = List.nth shape (List.length shape - 1)
let rec but_last = function [] | [ _ ] -> [] | x :: rest -> x :: but_last rest
let first_of count shape = List.filteri (fun k _ -> k < count) shape
let from count shape = List.filteri (fun k _ -> k >= count) shape
(* The place of an axis, which counts from the end where it is negative. *)
let axis_of axis rank =
  let counted = if axis < 0 then axis + rank else axis in
  if counted < 0 || counted >= rank then refuse "axis %d does not exist" axis;
  counted
(* The product, or more than `limit` where it is larger; of numbers >= 0. *)
let product ~limit sizes =
  List.fold_left (fun product n -> if n > 0 && product > limit / n then limit + 1 else product * n) 1 sizes

(* Places of a tensor, row by row, as places along each axis, and back. *)
let places_of shape k =
  snd (List.fold_right (fun size (k, places) -> k / size, k mod size :: places) shape (k, []))
let index_of shape places = List.fold_left2 (fun index size at -> index * size + at) 0 shape places

let require_numbers (t : tensor) =
  if not (is_float t.kind) then
    refuse ~hint:"convert before exporting: model.float()"
      "its constant has data type %d, but weights must be float16, bfloat16, float32 or float64" t.kind
let require_matrix (t : tensor) =
  require_numbers t;
  if List.length t.shape <> 2 || t.numbers = [||] then
    refuse "its weights of shape %s must have two dimensions, neither of size 0" (shown_shape t.shape)

(* The numbers of a tensor, one for each entry of `shape`. *)
let broadcast (t : tensor) shape =
  require_numbers t;
  let refuse () = refuse "its constant of shape %s does not fit its input" (shown_shape t.shape) in
  let rank = List.length shape in
  let rec shortened own = match own with
    | 1 :: rest when List.length own > rank -> shortened rest
    | own -> if List.length own > rank then refuse () else own in
  let own = shortened t.shape in
  let own = List.init (rank - List.length own) (fun _ -> 1) @ own in
  if not (List.for_all2 (fun n size -> n = 1 || n = size) own shape) then refuse ();
  Array.init (size shape) (fun k ->
      let places = List.map2 (fun n at -> if n = 1 then 0 else at) own (places_of shape k) in
      exactly t.numbers.(index_of own places))

(* Refuses a constant that operator sets before 7 align with other axes than the last ones of `shape`. *)
let require_trailing_axes node (t : tensor) shape ~operator_set =
  let own = List.length t.shape and rank = List.length shape in
  let is_by_channel = node.op = "PRelu" && operator_set > 0 && operator_set < 7 in
  let last = float_of_int (rank - own) in
  let axis = number node "axis" (if is_by_channel then 1. else last) in
  if Array.length t.numbers <> 1 && own < rank && axis <> last && axis <> float_of_int (-own) then
    refuse ~hint:"export with operator set 7 or newer: torch.onnx.export(..., opset_version=17)"
      "aligns its constant with other axes than the last ones, as before operator set 7"

(* Refuses training mode, which is stated by an attribute, the input `mode` of Dropout, or, for BatchNormalization
   before operator set 14, by the number of outputs. *)
let require_inference ?mode node =
  let by_outputs = node.op = "BatchNormalization" && not (has "is_test" node)
                   && List.length (List.filter (( <> ) "") node.outputs) > 1 in
  if number node "training_mode" 0. <> 0. || number node "is_test" 1. = 0. || by_outputs
  || (match mode with Some (t : tensor) -> t.integers <> [ 0 ] | None -> false) then
    refuse ~hint:"export the model after model.eval()" "is in training mode"

(* Refuses a cast of stored numbers that would change one of them. *)
let require_exact_cast node numbers ~hint =
  let kind = number node "to" 0. in
  let is_to some = List.exists (fun k -> kind = float_of_int k) some in
  let is_kept x =
    is_to [ float64 ] || (is_to [ float32 ] && Int32.float_of_bits (Int32.bits_of_float x) = x)
    || (is_to [ int32; int64 ] && Float.abs x < 0x1p31 && Float.trunc x = x) in
  if not (Array.for_all is_kept numbers) then refuse ~hint "rounds stored numbers"

(* The sizes `start` to `end` - 1 of a shape, both counted from the end if negative, and limited to the rank. *)
let sizes_between node shape =
  let rank = List.length shape in
  let place name otherwise =
    let stated = number node name (float_of_int otherwise) in
    let at = if stated < 0. then stated +. float_of_int rank else stated in
    if at >= float_of_int rank then rank else if at > 0. then int_of_float at else 0 in
  let start = place "start" 0 in
  from start (first_of (place "end" rank) shape)

(* Of Reshape: 0 copies a size, -1 is what is left. *)
let reshaped shape wanted ~zero_is_zero =
  let count = size shape in
  let refuse () = refuse "its shape does not fit its input" in
  let copied k n = if n = 0 && not zero_is_zero && k < List.length shape then List.nth shape k else n in
  let sizes = List.mapi copied wanted in
  let is_open n = n = -1 in
  if List.exists (fun n -> (n < 1 && not (is_open n)) || n > count) sizes
  || List.length (List.filter is_open sizes) > 1 then refuse ();
  let known = product ~limit:count (List.filter (fun n -> not (is_open n)) sizes) in
  let is_complete = not (List.exists is_open sizes) in
  if known > count || (if is_complete then known <> count else count mod known <> 0) then refuse ();
  List.map (fun n -> if is_open n then count / known else n) sizes

let flattened shape axis =
  let rank = List.length shape in
  let at = if axis = rank then rank else axis_of axis rank in
  let front = size (first_of at shape) in
  [ front; size shape / front ]

(* With or without sizes of 1 at these axes. *)
let squeezed shape axes ~adds =
  let rank = List.length shape + (if adds then List.length axes else 0) in
  if rank > 16 then refuse "its result has too many dimensions";
  let named = List.sort_uniq compare (List.map (fun axis -> axis_of axis rank) axes) in
  let result =
    if adds then begin
      if List.length named <> List.length axes then refuse "its axes do not fit its input";
      let rec filled d rest = if d = rank then [] else if List.mem d named then 1 :: filled (d + 1) rest
        else match rest with n :: rest -> n :: filled (d + 1) rest | [] -> [] in
      filled 0 shape
    end else List.filteri (fun d n -> not (List.mem d named || (axes = [] && n = 1))) shape in
  if size result <> size shape then refuse "its axes do not fit its input";
  result

(* The shape of the transposed tensor, and which entry of the original each of its entries is. *)
let transposition shape permutation =
  let rank = List.length shape in
  let axes = match permutation with
    | [] -> List.init rank (fun d -> rank - 1 - d)
    | _ -> List.map (fun axis -> axis_of axis rank) permutation in
  if List.sort compare axes <> List.init rank Fun.id then refuse "perm is not a permutation of its axes";
  let result = List.map (List.nth shape) axes in
  let which k =
    let places = List.combine axes (places_of result k) in
    index_of shape (List.init rank (fun d -> List.assoc d places)) in
  result, Array.init (size shape) which

let row_of_numbers count at =
  List.filter (fun (_, x) -> not (is_zero x)) (List.init count (fun k -> k, at k))
(* The biases of `rows` rows, each for `repeats` of them. *)
let shifts_of bias ~factor ~repeats rows = match bias with
  | None -> Array.make rows zero
  | Some (bias : tensor) ->
    require_numbers bias;
    let n = Array.length bias.numbers in
    if n <> 1 && n * repeats <> rows then refuse "its bias of shape %s does not fit" (shown_shape bias.shape);
    Array.init rows (fun i -> times factor (exactly bias.numbers.(if n = 1 then 0 else i / repeats)))

(* y = x W or x W', times `factor`. *)
let matrix (weight : tensor) ~outputs_first factor shifts =
  let a, b = List.hd weight.shape, last weight.shape in
  let inputs, outputs = if outputs_first then b, a else a, b in
  let at i j =
    let x = exactly weight.numbers.(if outputs_first then i * inputs + j else j * outputs + i) in
    if is_one factor then x else times factor x in
  { Folding.inputs; rows = Array.init outputs (fun i -> row_of_numbers inputs (at i)); shifts = shifts outputs }
let require_row shape axis inputs =
  if axis < 0 || List.nth shape axis <> inputs || size shape <> inputs then
    refuse "takes %d inputs, but gets the shape %s" inputs (shown_shape shape)

let gemm node weight bias shape =
  require_matrix weight;
  if number node "transA" 0. <> 0. then refuse "transposes its input";
  let beta = exactly (number node "beta" 1.) in
  let map = matrix weight ~outputs_first:(number node "transB" 0. <> 0.) (exactly (number node "alpha" 1.))
      (shifts_of bias ~factor:beta ~repeats:1) in
  require_row shape (List.length shape - 1) map.inputs;
  map, [ 1; Folding.size map ]
let matmul weight ~weight_is_left shape =
  require_matrix weight;
  let map = matrix weight ~outputs_first:weight_is_left one (fun rows -> Array.make rows zero) in
  let rank = List.length shape in
  let axis = if weight_is_left && rank >= 2 then rank - 2 else rank - 1 in
  require_row shape axis map.inputs;
  map, List.mapi (fun d n -> if d = axis then Folding.size map else n) shape

(* A window that slides along all axes behind the channels. *)
type window = { image : int list; kernel : int list; stride : int list; dilation : int list; before : int list;
                out : int list }

let most_step = 1 lsl 20
let window node shape kernel =
  let axes = List.length kernel in
  if axes = 0 || List.length shape <> axes + 2 || List.hd shape <> 1 then
    refuse "its input must have the shape [1, channels, sizes...]";
  let image = from 2 shape in
  let positive name =
    let sizes = listed node name (List.map (fun _ -> 1) kernel) in
    if List.length sizes <> axes || List.exists (fun n -> n < 1 || n > most_step) sizes then
      refuse "%s does not fit its window" name;
    sizes in
  let stride = positive "strides" in
  let dilation = positive "dilations" in
  if number node "ceil_mode" 0. <> 0. then refuse "ceil_mode is not 0";
  let reach = List.map2 (fun k d -> (k - 1) * d + 1) kernel dilation in
  let same is_upper =
    let total = List.map2 (fun (n, s) reach -> max 0 (((n + s - 1) / s - 1) * s + reach - n))
        (List.combine image stride) reach in
    List.map (fun n -> if is_upper then n / 2, n - n / 2 else n - n / 2, n / 2) total in
  let pads = match word node "auto_pad" "NOTSET" with
    | "NOTSET" ->
      let pads = listed node "pads" (List.init (2 * axes) (fun _ -> 0)) in
      if List.length pads <> 2 * axes then refuse "pads does not fit its window";
      List.combine (first_of axes pads) (from axes pads)
    | "SAME_UPPER" -> same true
    | "SAME_LOWER" -> same false
    | "VALID" -> List.map (fun _ -> 0, 0) kernel
    | _ -> refuse "auto_pad is unknown" in
  let fits n = n >= 0 && n <= most_step in
  if not (List.for_all (fun (before, after) -> fits before && fits after) pads) then
    refuse "pads does not fit its window";
  let room = List.map2 (fun (n, (before, after)) reach -> n + before + after - reach)
      (List.combine image pads) reach in
  if List.exists (fun n -> n < 0) room then refuse "its window is larger than its input";
  { image; kernel; stride; dilation; before = List.map fst pads;
    out = List.map2 (fun room stride -> room / stride + 1) room stride }

(* The entry of a channel that number k of the window covers at a place; None: padding. *)
let covered w place k =
  let start = List.map2 (fun (at, stride) before -> at * stride - before)
      (List.combine (places_of w.out place) w.stride) w.before in
  let places = List.map2 (fun start (k, dilation) -> start + k * dilation) start
      (List.combine (places_of w.kernel k) w.dilation) in
  if List.for_all2 (fun at size -> at >= 0 && at < size) places w.image then Some (index_of w.image places) else None
let limit_work sizes =
  if product ~limit:most_window_entries sizes > most_window_entries then
    too_large "as a dense layer it has too many numbers"
let limit_result rows = if rows > most_rows then too_large "as a dense layer it has too many numbers"

let convolution node (weight : tensor) bias shape =
  require_numbers weight;
  let refuse what = refuse "its weights of shape %s %s" (shown_shape weight.shape) what in
  if List.length weight.shape < 3 || weight.numbers = [||] then refuse "are not a kernel";
  let w = window node shape (from 2 weight.shape) in
  let outputs = List.hd weight.shape and per_group = List.nth weight.shape 1 and channels = List.nth shape 1 in
  let groups = whole node "group" 1 in
  if groups < 1 || groups > channels || channels <> per_group * groups || outputs mod groups <> 0 then
    refuse "do not fit its input";
  let places = size w.out and kernel = size w.kernel and image = size w.image in
  limit_work [ outputs; places; per_group; kernel ];
  limit_result (outputs * places);
  let entry_at = Array.init places (fun place -> Array.init kernel (covered w place)) in
  let row i =
    let o = i / places and place = i mod places in
    let first = o / (outputs / groups) * per_group in
    let entry c k = match entry_at.(place).(k) with
      | Some at ->
        let x = exactly weight.numbers.((o * per_group + c) * kernel + k) in
        if is_zero x then None else Some ((first + c) * image + at, x)
      | None -> None in
    List.concat (List.init per_group (fun c -> List.filter_map (entry c) (List.init kernel Fun.id))) in
  { Folding.inputs = size shape; rows = Array.init (outputs * places) row;
    shifts = shifts_of bias ~factor:one ~repeats:places (outputs * places) },
  1 :: outputs :: w.out

let is_global node = String.length node.op > 6 && String.sub node.op 0 6 = "Global"
(* For each place of a pooling window what it covers of a channel, and the window. *)
let pooled node shape =
  if List.length shape < 3 then refuse "its input must have the shape [1, channels, sizes...]";
  let kernel = if is_global node then from 2 shape else listed node "kernel_shape" [] in
  if List.exists (fun n -> n < 1 || n > most_step) kernel
  || product ~limit:Folding.most_numbers kernel > Folding.most_numbers then refuse "kernel_shape does not fit";
  let w = window node shape kernel in
  let channels = List.nth shape 1 and places = size w.out in
  limit_work [ channels; places; size kernel ];
  limit_result (channels * places);
  let covered_at = Array.init places (fun place ->
      List.filter_map (covered w place) (List.init (size kernel) Fun.id)) in
  if Array.mem [] covered_at then refuse "its window lies entirely in the padding";
  w, covered_at, 1 :: channels :: w.out

let average node shape =
  let w, covered_at, result = pooled node shape in
  let places = Array.length covered_at and image = size w.image in
  let counts_padding = number node "count_include_pad" 0. <> 0. in
  let row i =
    let entries = covered_at.(i mod places) in
    let count = if counts_padding then size w.kernel else List.length entries in
    let share = divided one (exactly (float_of_int count)) in
    List.map (fun at -> i / places * image + at, share) entries in
  { Folding.inputs = size shape; rows = Array.init (size result) row; shifts = Array.make (size result) zero }, result

(* Of each entry of the result of max-pooling, the entries of which it is the largest. *)
let max_windows node shape =
  let w, covered_at, result = pooled node shape in
  let places = Array.length covered_at and image = size w.image in
  Array.init (size result) (fun i -> List.map (fun at -> i / places * image + at) covered_at.(i mod places)), result

(* Of batch normalization in inference: factor and amount of each entry, y = factor x + amount. *)
let normalization node parameters shape =
  require_inference node;
  let channels = match shape with _ :: n :: _ -> n | _ -> 0 in
  List.iter (fun (t : tensor) ->
      require_numbers t;
      if Array.length t.numbers <> channels then refuse "its parameters do not fit its channels") parameters;
  (* The attribute is a float32, and so is its default, 1e-5. *)
  let epsilon = exactly (number node "epsilon" (Exact.float32 1e-5)) in
  let of_channel c =
    let parameter p = exactly (List.nth parameters p).numbers.(c) in
    let variance = value (add (add empty (parameter 3)) epsilon) in
    if not (variance.value > variance.radius) then refuse "its variance is not positive";
    let factor = divided (parameter 0) (square_root variance) in
    factor, value (add_product (add empty (parameter 1)) (opposite factor) (parameter 2)) in
  let each = Array.init channels of_channel and repeats = size shape / max channels 1 in
  (fun k -> fst each.(k / repeats)), (fun k -> snd each.(k / repeats))

(* Places and shape of Pad, and what each entry of the result copies; None: the filler. *)
let padding node pads ?axes shape =
  let rank = List.length shape in
  (match axes with
   | Some (t : tensor) when List.map (fun axis -> axis_of axis rank) t.integers <> List.init rank Fun.id ->
     refuse ~hint:"state pads for every axis" "its axes are not all axes of its input in order"
   | _ -> ());
  if word node "mode" "constant" <> "constant" then refuse "its mode is not constant";
  if List.length pads <> 2 * rank then refuse "pads does not fit its input";
  let before = first_of rank pads and after = from rank pads in
  if List.exists2 (fun b a -> b < 0 || a < 0 || b + a > most_step) before after then
    refuse "pads does not fit its input";
  let result = List.map2 (fun n pad -> n + pad) shape (List.map2 ( + ) before after) in
  if product ~limit:most_rows result > most_rows then too_large "its result has more than 2^20 entries";
  let copied k =
    let places = List.map2 ( - ) (places_of result k) before in
    if List.for_all2 (fun at n -> at >= 0 && at < n) places shape then Some (index_of shape places) else None in
  result, Array.init (size result) copied

(* Of tensors of these shapes along an axis: the shape of the result, and which entry of all of them one behind the
   other each of its entries is. *)
let concatenation shapes axis =
  let first = List.hd shapes in
  let axis = axis_of axis (List.length first) in
  let without shape = List.filteri (fun d _ -> d <> axis) shape in
  if List.exists (fun s -> List.length s <> List.length first || without s <> without first) shapes then
    refuse "its inputs are of different shapes";
  let total = List.fold_left (fun n shape -> n + List.nth shape axis) 0 shapes in
  let result = List.mapi (fun d n -> if d = axis then total else n) first in
  if product ~limit:most_rows result > most_rows then too_large "its result has more than 2^20 entries";
  let after = size (from (axis + 1) first) in
  let sizes = List.map (fun shape -> List.nth shape axis * after) shapes in
  let before = size (first_of axis first) in
  let parts = List.init before (fun b ->
      snd (List.fold_left (fun (offset, parts) n ->
          offset + n * before, Array.init n (fun i -> offset + b * n + i) :: parts) (0, []) sizes)) in
  result, Array.concat (List.concat_map List.rev parts)

(* Of a node that sorts a layer: what it does, the shape of its result, and which number of the sorted layer each of its
   entries is. `integers node k name`: an attribute of older models and input k of newer ones. *)
let sorting integers node shape =
  let hint = "MaxMin is recognized as Split into two halves, their Max and Min, and Concat, or as ReduceMax and \
              ReduceMin of pairs along the last axis and Concat; GroupSort as TopK of the whole last axis" in
  let require condition what = if not condition then refuse ~hint "%s" what in
  let rank = List.length shape and n = if shape = [] then 0 else last shape in
  let same = Array.init (size shape) Fun.id in
  let is_first axis shape = size (first_of axis shape) = 1 in
  match node.op, node.parts with
  | "MaxMin", [ split; concat ] ->
    let axis = axis_of (whole split "axis" 0) rank in
    let half = List.nth shape axis / 2 in
    require (List.nth shape axis = 2 * half && List.mem (integers split 1 "split") [ []; [ half; half ] ])
      "joins parts that are not halves";
    require (axis_of (whole concat "axis" 0) rank = axis && is_first axis shape)
      "does not join the halves of the whole layer along the axis of the Split before it";
    Proved.Halves, shape, same
  | "PairsMaxMin", [ first; second; concat ] ->
    let of_pairs node =
      let axes = integers node 1 "axes" in
      rank >= 2 && List.length axes = 1 && axis_of (List.hd axes) rank = rank - 1 && n = 2
      && whole node "keepdims" 1 = 0 in
    require (of_pairs first && of_pairs second) "joins other maxima and minima than those of pairs along the last axis";
    let shape = but_last shape in
    require (axis_of (whole concat "axis" 0) (rank - 1) = rank - 2 && is_first (rank - 2) shape)
      "does not join the maxima and minima of the whole layer";
    Proved.Pairs, but_last shape @ [ 2 * last shape ], same
  | _ ->
    let sizes = if has "k" node then [ whole node "k" 0 ] else integers node 1 "k" in
    require (rank > 0 && axis_of (whole node "axis" (-1)) rank = rank - 1 && sizes = [ n ]
             && whole node "sorted" 1 = 1) "does not sort the whole last axis";
    require (n >= 2 && n <= 64) "sorts groups of less than 2 or more than 64 numbers";
    let largest_first k = k - k mod n + n - 1 - k mod n in
    Proved.Groups n, shape, if whole node "largest" 1 = 0 then same else Array.map largest_first same
