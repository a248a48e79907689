
(** val negb : bool -> bool **)

let negb = function
| true -> false
| false -> true

(** val option_map : ('a1 -> 'a2) -> 'a1 option -> 'a2 option **)

let option_map f = function
| Some a -> Some (f a)
| None -> None

(** val fst : ('a1 * 'a2) -> 'a1 **)

let fst = function
| (x, _) -> x

(** val snd : ('a1 * 'a2) -> 'a2 **)

let snd = function
| (_, y) -> y

(** val length : 'a1 list -> int **)

let rec length = function
| [] -> 0
| _ :: l' -> Stdlib.Int.succ (length l')

(** val app : 'a1 list -> 'a1 list -> 'a1 list **)

let rec app l m =
  match l with
  | [] -> m
  | a :: l1 -> a :: (app l1 m)

type comparison =
| Eq
| Lt
| Gt

(** val compOpp : comparison -> comparison **)

let compOpp = function
| Eq -> Eq
| Lt -> Gt
| Gt -> Lt

(** val add : int -> int -> int **)

let rec add = (+)

(** val mul : int -> int -> int **)

let rec mul = ( * )

(** val sub : int -> int -> int **)

let rec sub = fun n m -> Stdlib.max 0 (n-m)



(** val eqb : bool -> bool -> bool **)

let eqb b1 b2 =
  if b1 then b2 else if b2 then false else true

module Nat =
 struct
  (** val even : int -> bool **)

  let rec even n =
    (fun fO fS n -> if n=0 then fO () else fS (n-1))
      (fun _ -> true)
      (fun n0 ->
      (fun fO fS n -> if n=0 then fO () else fS (n-1))
        (fun _ -> false)
        (fun n' -> even n')
        n0)
      n

  (** val divmod : int -> int -> int -> int -> int * int **)

  let rec divmod x y q u =
    (fun fO fS n -> if n=0 then fO () else fS (n-1))
      (fun _ -> (q, u))
      (fun x' ->
      (fun fO fS n -> if n=0 then fO () else fS (n-1))
        (fun _ -> divmod x' y (Stdlib.Int.succ q) y)
        (fun u' -> divmod x' y q u')
        u)
      x

  (** val div : int -> int -> int **)

  let div x y =
    (fun fO fS n -> if n=0 then fO () else fS (n-1))
      (fun _ -> y)
      (fun y' -> fst (divmod x y' 0 y'))
      y

  (** val div2 : int -> int **)

  let rec div2 = fun n -> n/2
 end

module Pos =
 struct
  (** val succ : Big.t -> Big.t **)

  let rec succ x =
    (fun _ _ _ _ -> assert false)
      (fun p -> (fun p -> Big.shift_left p 1) (succ p))
      (fun p -> (fun p -> Big.succ (Big.shift_left p 1)) p)
      (fun _ -> (fun p -> Big.shift_left p 1) Big.one)
      x

  (** val add : Big.t -> Big.t -> Big.t **)

  let rec add x y =
    (fun _ _ _ _ -> assert false)
      (fun p ->
      (fun _ _ _ _ -> assert false)
        (fun q -> (fun p -> Big.shift_left p 1) (add_carry p q))
        (fun q -> (fun p -> Big.succ (Big.shift_left p 1))
        (add p q))
        (fun _ -> (fun p -> Big.shift_left p 1) (succ p))
        y)
      (fun p ->
      (fun _ _ _ _ -> assert false)
        (fun q -> (fun p -> Big.succ (Big.shift_left p 1))
        (add p q))
        (fun q -> (fun p -> Big.shift_left p 1) (add p q))
        (fun _ -> (fun p -> Big.succ (Big.shift_left p 1)) p)
        y)
      (fun _ ->
      (fun _ _ _ _ -> assert false)
        (fun q -> (fun p -> Big.shift_left p 1) (succ q))
        (fun q -> (fun p -> Big.succ (Big.shift_left p 1)) q)
        (fun _ -> (fun p -> Big.shift_left p 1) Big.one)
        y)
      x

  (** val add_carry : Big.t -> Big.t -> Big.t **)

  and add_carry x y =
    (fun _ _ _ _ -> assert false)
      (fun p ->
      (fun _ _ _ _ -> assert false)
        (fun q -> (fun p -> Big.succ (Big.shift_left p 1))
        (add_carry p q))
        (fun q -> (fun p -> Big.shift_left p 1) (add_carry p q))
        (fun _ -> (fun p -> Big.succ (Big.shift_left p 1)) (succ p))
        y)
      (fun p ->
      (fun _ _ _ _ -> assert false)
        (fun q -> (fun p -> Big.shift_left p 1) (add_carry p q))
        (fun q -> (fun p -> Big.succ (Big.shift_left p 1))
        (add p q))
        (fun _ -> (fun p -> Big.shift_left p 1) (succ p))
        y)
      (fun _ ->
      (fun _ _ _ _ -> assert false)
        (fun q -> (fun p -> Big.succ (Big.shift_left p 1)) (succ q))
        (fun q -> (fun p -> Big.shift_left p 1) (succ q))
        (fun _ -> (fun p -> Big.succ (Big.shift_left p 1)) Big.one)
        y)
      x

  (** val pred_double : Big.t -> Big.t **)

  let rec pred_double x =
    (fun _ _ _ _ -> assert false)
      (fun p -> (fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) p))
      (fun p -> (fun p -> Big.succ (Big.shift_left p 1))
      (pred_double p))
      (fun _ -> Big.one)
      x

  (** val mul : Big.t -> Big.t -> Big.t **)

  let rec mul x y =
    (fun _ _ _ _ -> assert false)
      (fun p -> add y ((fun p -> Big.shift_left p 1) (mul p y)))
      (fun p -> (fun p -> Big.shift_left p 1) (mul p y))
      (fun _ -> y)
      x

  (** val iter : ('a1 -> 'a1) -> 'a1 -> Big.t -> 'a1 **)

  let rec iter f x n =
    (fun _ _ _ _ -> assert false)
      (fun n' -> f (iter f (iter f x n') n'))
      (fun n' -> iter f (iter f x n') n')
      (fun _ -> f x)
      n

  (** val div2 : Big.t -> Big.t **)

  let div2 p =
    (fun _ _ _ _ -> assert false)
      (fun p0 -> p0)
      (fun p0 -> p0)
      (fun _ -> Big.one)
      p

  (** val div2_up : Big.t -> Big.t **)

  let div2_up p =
    (fun _ _ _ _ -> assert false)
      (fun p0 -> succ p0)
      (fun p0 -> p0)
      (fun _ -> Big.one)
      p

  (** val size : Big.t -> Big.t **)

  let rec size p =
    (fun _ _ _ _ -> assert false)
      (fun p0 -> succ (size p0))
      (fun p0 -> succ (size p0))
      (fun _ -> Big.one)
      p

  (** val compare_cont : comparison -> Big.t -> Big.t -> comparison **)

  let rec compare_cont r x y =
    (fun _ _ _ _ -> assert false)
      (fun p ->
      (fun _ _ _ _ -> assert false)
        (fun q -> compare_cont r p q)
        (fun q -> compare_cont Gt p q)
        (fun _ -> Gt)
        y)
      (fun p ->
      (fun _ _ _ _ -> assert false)
        (fun q -> compare_cont Lt p q)
        (fun q -> compare_cont r p q)
        (fun _ -> Gt)
        y)
      (fun _ ->
      (fun _ _ _ _ -> assert false)
        (fun _ -> Lt)
        (fun _ -> Lt)
        (fun _ -> r)
        y)
      x

  (** val compare : Big.t -> Big.t -> comparison **)

  let compare =
    compare_cont Eq

  (** val eqb : Big.t -> Big.t -> bool **)

  let rec eqb p q =
    (fun _ _ _ _ -> assert false)
      (fun p0 ->
      (fun _ _ _ _ -> assert false)
        (fun q0 -> eqb p0 q0)
        (fun _ -> false)
        (fun _ -> false)
        q)
      (fun p0 ->
      (fun _ _ _ _ -> assert false)
        (fun _ -> false)
        (fun q0 -> eqb p0 q0)
        (fun _ -> false)
        q)
      (fun _ ->
      (fun _ _ _ _ -> assert false)
        (fun _ -> false)
        (fun _ -> false)
        (fun _ -> true)
        q)
      p
 end

module Z =
 struct
  (** val double : Big.t -> Big.t **)

  let double x =
    (fun _ _ _ _ -> assert false)
      (fun _ -> Big.zero)
      (fun p -> (fun p -> p) ((fun p -> Big.shift_left p 1) p))
      (fun p -> Big.neg ((fun p -> Big.shift_left p 1) p))
      x

  (** val succ_double : Big.t -> Big.t **)

  let succ_double x =
    (fun _ _ _ _ -> assert false)
      (fun _ -> (fun p -> p) Big.one)
      (fun p -> (fun p -> p) ((fun p -> Big.succ (Big.shift_left p 1))
      p))
      (fun p -> Big.neg (Pos.pred_double p))
      x

  (** val pred_double : Big.t -> Big.t **)

  let pred_double x =
    (fun _ _ _ _ -> assert false)
      (fun _ -> Big.neg Big.one)
      (fun p -> (fun p -> p) (Pos.pred_double p))
      (fun p -> Big.neg ((fun p -> Big.succ (Big.shift_left p 1)) p))
      x

  (** val pos_sub : Big.t -> Big.t -> Big.t **)

  let rec pos_sub x y =
    (fun _ _ _ _ -> assert false)
      (fun p ->
      (fun _ _ _ _ -> assert false)
        (fun q -> double (pos_sub p q))
        (fun q -> succ_double (pos_sub p q))
        (fun _ -> (fun p -> p) ((fun p -> Big.shift_left p 1) p))
        y)
      (fun p ->
      (fun _ _ _ _ -> assert false)
        (fun q -> pred_double (pos_sub p q))
        (fun q -> double (pos_sub p q))
        (fun _ -> (fun p -> p) (Pos.pred_double p))
        y)
      (fun _ ->
      (fun _ _ _ _ -> assert false)
        (fun q -> Big.neg ((fun p -> Big.shift_left p 1) q))
        (fun q -> Big.neg (Pos.pred_double q))
        (fun _ -> Big.zero)
        y)
      x

  (** val compare : Big.t -> Big.t -> comparison **)

  let compare x y =
    (fun _ _ _ _ -> assert false)
      (fun _ ->
      (fun _ _ _ _ -> assert false)
        (fun _ -> Eq)
        (fun _ -> Lt)
        (fun _ -> Gt)
        y)
      (fun x' ->
      (fun _ _ _ _ -> assert false)
        (fun _ -> Gt)
        (fun y' -> Pos.compare x' y')
        (fun _ -> Gt)
        y)
      (fun x' ->
      (fun _ _ _ _ -> assert false)
        (fun _ -> Lt)
        (fun _ -> Lt)
        (fun y' -> compOpp (Pos.compare x' y'))
        y)
      x

  (** val pos_div_eucl : Big.t -> Big.t -> Big.t * Big.t **)

  let rec pos_div_eucl a b =
    (fun _ _ _ _ -> assert false)
      (fun a' ->
      let (q, r) = pos_div_eucl a' b in
      let r' =
        Big.add
          (Big.mul ((fun p -> p) ((fun p -> Big.shift_left p 1) Big.one)) r)
          ((fun p -> p) Big.one)
      in
      if Big.lt r' b
      then ((Big.mul ((fun p -> p) ((fun p -> Big.shift_left p 1) Big.one)) q),
             r')
      else ((Big.add
              (Big.mul ((fun p -> p) ((fun p -> Big.shift_left p 1) Big.one))
                q) ((fun p -> p) Big.one)), (Big.sub r' b)))
      (fun a' ->
      let (q, r) = pos_div_eucl a' b in
      let r' =
        Big.mul ((fun p -> p) ((fun p -> Big.shift_left p 1) Big.one)) r
      in
      if Big.lt r' b
      then ((Big.mul ((fun p -> p) ((fun p -> Big.shift_left p 1) Big.one)) q),
             r')
      else ((Big.add
              (Big.mul ((fun p -> p) ((fun p -> Big.shift_left p 1) Big.one))
                q) ((fun p -> p) Big.one)), (Big.sub r' b)))
      (fun _ ->
      if Big.leq ((fun p -> p) ((fun p -> Big.shift_left p 1) Big.one)) b
      then (Big.zero, ((fun p -> p) Big.one))
      else (((fun p -> p) Big.one), Big.zero))
      a

  (** val div_eucl : Big.t -> Big.t -> Big.t * Big.t **)

  let div_eucl a b =
    (fun _ _ _ _ -> assert false)
      (fun _ -> (Big.zero, Big.zero))
      (fun a' ->
      (fun _ _ _ _ -> assert false)
        (fun _ -> (Big.zero, a))
        (fun _ -> pos_div_eucl a' b)
        (fun b' ->
        let (q, r) = pos_div_eucl a' ((fun p -> p) b') in
        ((fun _ _ _ _ -> assert false)
           (fun _ -> ((Big.neg q), Big.zero))
           (fun _ -> ((Big.neg (Big.add q ((fun p -> p) Big.one))),
           (Big.add b r)))
           (fun _ -> ((Big.neg (Big.add q ((fun p -> p) Big.one))),
           (Big.add b r)))
           r))
        b)
      (fun a' ->
      (fun _ _ _ _ -> assert false)
        (fun _ -> (Big.zero, a))
        (fun _ ->
        let (q, r) = pos_div_eucl a' b in
        ((fun _ _ _ _ -> assert false)
           (fun _ -> ((Big.neg q), Big.zero))
           (fun _ -> ((Big.neg (Big.add q ((fun p -> p) Big.one))),
           (Big.sub b r)))
           (fun _ -> ((Big.neg (Big.add q ((fun p -> p) Big.one))),
           (Big.sub b r)))
           r))
        (fun b' ->
        let (q, r) = pos_div_eucl a' ((fun p -> p) b') in (q, (Big.neg r)))
        b)
      a

  (** val div2 : Big.t -> Big.t **)

  let div2 z0 =
    (fun _ _ _ _ -> assert false)
      (fun _ -> Big.zero)
      (fun p ->
      (fun _ _ _ _ -> assert false)
        (fun _ -> (fun p -> p) (Pos.div2 p))
        (fun _ -> (fun p -> p) (Pos.div2 p))
        (fun _ -> Big.zero)
        p)
      (fun p -> Big.neg (Pos.div2_up p))
      z0
 end

(** val hd : 'a1 -> 'a1 list -> 'a1 **)

let hd default = function
| [] -> default
| x :: _ -> x

(** val tl : 'a1 list -> 'a1 list **)

let tl = function
| [] -> []
| _ :: m -> m

(** val nth : int -> 'a1 list -> 'a1 -> 'a1 **)

let rec nth n l default =
  (fun fO fS n -> if n=0 then fO () else fS (n-1))
    (fun _ -> match l with
              | [] -> default
              | x :: _ -> x)
    (fun m -> match l with
              | [] -> default
              | _ :: t -> nth m t default)
    n

(** val nth_error : 'a1 list -> int -> 'a1 option **)

let rec nth_error l n =
  (fun fO fS n -> if n=0 then fO () else fS (n-1))
    (fun _ -> match l with
              | [] -> None
              | x :: _ -> Some x)
    (fun n0 -> match l with
               | [] -> None
               | _ :: l0 -> nth_error l0 n0)
    n

(** val last : 'a1 list -> 'a1 -> 'a1 **)

let rec last l d =
  match l with
  | [] -> d
  | a :: l0 -> (match l0 with
                | [] -> a
                | _ :: _ -> last l0 d)

(** val concat : 'a1 list list -> 'a1 list **)

let rec concat = function
| [] -> []
| x :: l0 -> app x (concat l0)

(** val map : ('a1 -> 'a2) -> 'a1 list -> 'a2 list **)

let rec map f = function
| [] -> []
| a :: t -> (f a) :: (map f t)

(** val flat_map : ('a1 -> 'a2 list) -> 'a1 list -> 'a2 list **)

let rec flat_map f = function
| [] -> []
| x :: t -> app (f x) (flat_map f t)

(** val fold_left : ('a1 -> 'a2 -> 'a1) -> 'a2 list -> 'a1 -> 'a1 **)

let rec fold_left f l a0 =
  match l with
  | [] -> a0
  | b :: t -> fold_left f t (f a0 b)

(** val fold_right : ('a2 -> 'a1 -> 'a1) -> 'a1 -> 'a2 list -> 'a1 **)

let rec fold_right f a0 = function
| [] -> a0
| b :: t -> f b (fold_right f a0 t)

(** val existsb : ('a1 -> bool) -> 'a1 list -> bool **)

let rec existsb f = function
| [] -> false
| a :: l0 -> (||) (f a) (existsb f l0)

(** val forallb : ('a1 -> bool) -> 'a1 list -> bool **)

let rec forallb f = function
| [] -> true
| a :: l0 -> (&&) (f a) (forallb f l0)

(** val filter : ('a1 -> bool) -> 'a1 list -> 'a1 list **)

let rec filter f = function
| [] -> []
| x :: l0 -> if f x then x :: (filter f l0) else filter f l0

(** val combine : 'a1 list -> 'a2 list -> ('a1 * 'a2) list **)

let rec combine l l' =
  match l with
  | [] -> []
  | x :: tl0 ->
    (match l' with
     | [] -> []
     | y :: tl' -> (x, y) :: (combine tl0 tl'))

(** val firstn : int -> 'a1 list -> 'a1 list **)

let rec firstn n l =
  (fun fO fS n -> if n=0 then fO () else fS (n-1))
    (fun _ -> [])
    (fun n0 -> match l with
               | [] -> []
               | a :: l0 -> a :: (firstn n0 l0))
    n

(** val skipn : int -> 'a1 list -> 'a1 list **)

let rec skipn n l =
  (fun fO fS n -> if n=0 then fO () else fS (n-1))
    (fun _ -> l)
    (fun n0 -> match l with
               | [] -> []
               | _ :: l0 -> skipn n0 l0)
    n

(** val seq : int -> int -> int list **)

let rec seq start len =
  (fun fO fS n -> if n=0 then fO () else fS (n-1))
    (fun _ -> [])
    (fun len0 -> start :: (seq (Stdlib.Int.succ start) len0))
    len

(** val repeat : 'a1 -> int -> 'a1 list **)

let rec repeat x n =
  (fun fO fS n -> if n=0 then fO () else fS (n-1))
    (fun _ -> [])
    (fun k -> x :: (repeat x k))
    n

(** val dot :
    'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list
    -> 'a1 **)

let rec dot zero0 add1 mul1 u v =
  match u with
  | [] -> zero0
  | a :: u' ->
    (match v with
     | [] -> zero0
     | b :: v' -> add1 (mul1 a b) (dot zero0 add1 mul1 u' v'))

(** val apply :
    'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 list list -> 'a1
    list -> 'a1 list **)

let apply zero0 add1 mul1 m v =
  map (fun row -> dot zero0 add1 mul1 row v) m

(** val plus : ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list -> 'a1 list **)

let rec plus add1 u v =
  match u with
  | [] -> v
  | a :: u' ->
    (match v with
     | [] -> u
     | b :: v' -> (add1 a b) :: (plus add1 u' v'))

(** val scale : ('a1 -> 'a1 -> 'a1) -> 'a1 -> 'a1 list -> 'a1 list **)

let scale mul1 a u =
  map (mul1 a) u

(** val scale_all :
    ('a1 -> 'a1 -> 'a1) -> 'a1 -> 'a1 list list -> 'a1 list list **)

let scale_all mul1 a m =
  map (scale mul1 a) m

(** val times : ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list -> 'a1 list **)

let rec times mul1 u v =
  match u with
  | [] -> []
  | a :: u' ->
    (match v with
     | [] -> []
     | b :: v' -> (mul1 a b) :: (times mul1 u' v'))

(** val scale_rows :
    ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list list -> 'a1 list list **)

let rec scale_rows mul1 t m =
  match t with
  | [] -> []
  | a :: t' ->
    (match m with
     | [] -> []
     | row :: m' -> (scale mul1 a row) :: (scale_rows mul1 t' m'))

(** val columns : 'a1 -> int -> 'a1 list list -> 'a1 list list **)

let rec columns zero0 n m =
  (fun fO fS n -> if n=0 then fO () else fS (n-1))
    (fun _ -> [])
    (fun n' -> (map (hd zero0) m) :: (columns zero0 n' (map tl m)))
    n

(** val product :
    'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 list list -> 'a1
    list list -> 'a1 list list **)

let product zero0 add1 mul1 a b =
  let b' = columns zero0 (length (hd [] b)) b in
  map (fun row -> apply zero0 add1 mul1 b' row) a

(** val sum :
    ('a1 -> 'a1 -> 'a1) -> 'a1 list list -> 'a1 list list -> 'a1 list list **)

let rec sum add1 a b =
  match a with
  | [] -> b
  | r :: a' ->
    (match b with
     | [] -> a
     | s :: b' -> (plus add1 r s) :: (sum add1 a' b'))

(** val gram :
    'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 list list -> 'a1
    list list **)

let rec gram zero0 add1 mul1 m = match m with
| [] -> []
| row :: m' -> (map (dot zero0 add1 mul1 row) m) :: (gram zero0 add1 mul1 m')

(** val diagonal_block : 'a1 -> 'a1 list -> 'a1 list list -> 'a1 list list **)

let rec diagonal_block zero0 t right =
  match t with
  | [] -> []
  | a :: t' ->
    (match right with
     | [] -> []
     | row :: right' ->
       (a :: (app (repeat zero0 (length t')) row)) :: (diagonal_block zero0
                                                        t' right'))

(** val diagonal : 'a1 -> 'a1 list -> 'a1 list list **)

let diagonal zero0 t =
  diagonal_block zero0 t (map (fun _ -> []) t)

(** val band :
    'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 -> 'a1 -> 'a1
    list -> ('a1 list * 'a1 list list) list -> 'a1 list list -> 'a1 list list **)

let rec band zero0 add1 mul1 two_rho minus_rho t later last0 =
  match later with
  | [] ->
    sum add1 (diagonal zero0 (scale mul1 two_rho t))
      (scale_all mul1 minus_rho
        (gram zero0 add1 mul1 (columns zero0 (length t) last0)))
  | p :: later' ->
    let (t2, m2) = p in
    app
      (diagonal_block zero0 (scale mul1 two_rho t)
        (columns zero0 (length t)
          (scale_all mul1 minus_rho (scale_rows mul1 t2 m2))))
      (band zero0 add1 mul1 two_rho minus_rho t2 later' last0)

(** val lmi :
    'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 -> 'a1 -> 'a1 ->
    'a1 list -> 'a1 list list -> ('a1 list * 'a1 list list) list -> 'a1 list
    list -> 'a1 list list **)

let lmi zero0 add1 mul1 minus_one0 two_rho minus_rho t first0 later last0 =
  sum add1
    (scale_all mul1 minus_one0
      (gram zero0 add1 mul1 (scale_rows mul1 t first0)))
    (band zero0 add1 mul1 two_rho minus_rho t later last0)

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

(** val inserted :
    ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 -> 'a1 list -> 'a1 list **)

let rec inserted low high a = function
| [] -> a :: []
| b :: l' -> (low a b) :: (inserted low high (high a b) l')

(** val ascending :
    ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list **)

let ascending low high l =
  fold_right (inserted low high) [] l

(** val sorted_groups :
    ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> int -> int -> 'a1 list ->
    'a1 list **)

let rec sorted_groups low high n k l =
  (fun fO fS n -> if n=0 then fO () else fS (n-1))
    (fun _ -> [])
    (fun n' ->
    app (ascending low high (firstn k l))
      (sorted_groups low high n' k (skipn k l)))
    n

(** val both : ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list -> 'a1 list **)

let both f u v =
  map (fun p -> f (fst p) (snd p)) (combine u v)

(** val of_halves : ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list **)

let of_halves f l =
  let h = Nat.div2 (length l) in both f (firstn h l) (skipn h l)

(** val of_pairs : ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list **)

let rec of_pairs f = function
| [] -> []
| a :: l0 -> (match l0 with
              | [] -> []
              | b :: l' -> (f a b) :: (of_pairs f l'))

(** val sorted_by :
    ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> sorting -> 'a1 list -> 'a1
    list **)

let sorted_by low high s l =
  match s with
  | Groups k -> sorted_groups low high (length l) k l
  | Halves -> app (of_halves high l) (of_halves low l)
  | Pairs -> app (of_pairs high l) (of_pairs low l)

(** val base : activation -> activation **)

let rec base a = match a with
| Keeping (_, b) -> base b
| _ -> a

(** val by_number :
    (activation -> 'a1 -> 'a2) -> ('a1 -> 'a2) -> activation -> 'a1 list ->
    'a2 list **)

let rec by_number f g a l =
  match a with
  | Keeping (n, b) -> app (by_number f g b (firstn n l)) (map g (skipn n l))
  | _ -> map (f a) l

type 't relation =
| Each of ('t * 't) list
| Grouped of int * int

(** val spread : int -> 'a1 list -> 'a1 list **)

let spread k t =
  flat_map (fun a -> repeat a k) t

(** val weighted_gram :
    'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 list -> 'a1 list
    list -> 'a1 list list **)

let rec weighted_gram zero0 add1 mul1 s m = match m with
| [] -> []
| row :: m' ->
  (map (dot zero0 add1 mul1 (times mul1 s row)) m) :: (weighted_gram zero0
                                                        add1 mul1 s m')

type 't bent_layer = (('t * 't) list * 't list) * 't list list

(** val ranges_of : 'a1 bent_layer -> ('a1 * 'a1) list **)

let ranges_of k =
  fst (fst k)

(** val multipliers_of : 'a1 bent_layer -> 'a1 list **)

let multipliers_of k =
  snd (fst k)

(** val sums : ('a1 -> 'a1 -> 'a1) -> ('a1 * 'a1) list -> 'a1 list **)

let sums add1 r =
  map (fun i -> add1 (fst i) (snd i)) r

(** val products : ('a1 -> 'a1 -> 'a1) -> ('a1 * 'a1) list -> 'a1 list **)

let products mul1 r =
  map (fun i -> mul1 (fst i) (snd i)) r

(** val bends :
    'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> int -> 'a1
    bent_layer list -> 'a1 list list **)

let rec bends zero0 add1 mul1 n = function
| [] -> []
| b :: hidden' ->
  let (p, m) = b in
  let (r, t) = p in
  app
    (weighted_gram zero0 add1 mul1 (times mul1 t (products mul1 r))
      (columns zero0 n m)) (bends zero0 add1 mul1 (length t) hidden')

(** val weighted :
    ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 bent_layer list -> ('a1
    list * 'a1 list list) list **)

let weighted add1 mul1 hidden0 =
  map (fun k -> ((multipliers_of k),
    (scale_rows mul1 (sums add1 (ranges_of k)) (snd k)))) hidden0

(** val bent_lmi :
    'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> 'a1 -> 'a1 -> 'a1
    list -> 'a1 bent_layer list -> 'a1 list list -> 'a1 list list **)

let bent_lmi zero0 add1 mul1 two minus_one0 t hidden0 last0 =
  sum add1
    (band zero0 add1 mul1 two minus_one0 t (weighted add1 mul1 hidden0) last0)
    (scale_all mul1 two (bends zero0 add1 mul1 (length t) hidden0))

(** val fitted : 'a1 -> ('a1 -> 'a1 -> 'a1) -> int -> 'a1 list -> 'a1 list **)

let fitted zero0 add1 n u =
  firstn n (plus add1 u (repeat zero0 n))

(** val sum_rows :
    'a1 -> ('a1 -> 'a1 -> 'a1) -> 'a1 -> int -> int -> int -> int -> 'a1 list
    list -> 'a1 list list **)

let rec sum_rows zero0 add1 minus_one0 inputs0 before n k m =
  (fun fO fS n -> if n=0 then fO () else fS (n-1))
    (fun _ -> [])
    (fun n' ->
    (app (fitted zero0 add1 inputs0 (fold_right (plus add1) [] (firstn k m)))
      (app (repeat zero0 before) (repeat minus_one0 k))) :: (sum_rows zero0
                                                              add1 minus_one0
                                                              inputs0
                                                              (add before k)
                                                              n' k
                                                              (skipn k m)))
    n

type 't pin = ('t list * 't list list) * int

(** val pins :
    'a1 -> ('a1 -> 'a1 -> 'a1) -> ('a1 -> 'a1 -> 'a1) -> int -> 'a1 pin list
    -> 'a1 list list **)

let rec pins zero0 add1 mul1 n = function
| [] -> []
| p :: ps' ->
  let (p0, width) = p in
  let (s, rows0) = p0 in
  sum add1
    (weighted_gram zero0 add1 mul1 s (columns zero0 (add n width) rows0))
    (app (repeat [] n) (pins zero0 add1 mul1 width ps'))

(** val dotZ : Big.t list -> Big.t list -> Big.t **)

let rec dotZ u v =
  match u with
  | [] -> Big.zero
  | a :: u' ->
    (match v with
     | [] -> Big.zero
     | b :: v' -> Big.add (Big.mul a b) (dotZ u' v'))

(** val strip : Big.t list -> int * Big.t list **)

let rec strip row = match row with
| [] -> (0, [])
| a :: row' ->
  if Big.equal a Big.zero
  then let (n, rest0) = strip row' in ((Stdlib.Int.succ n), rest0)
  else (0, row)

(** val dot_stripped : (int * Big.t list) -> (int * Big.t list) -> Big.t **)

let dot_stripped u v =
  let (i, a) = u in
  let (j, b) = v in
  if (<=) i j then dotZ (skipn (sub j i) a) b else dotZ a (skipn (sub i j) b)

(** val gram_stripped : (int * Big.t list) list -> Big.t list list **)

let rec gram_stripped rows0 = match rows0 with
| [] -> []
| row :: rows' -> (map (dot_stripped row) rows0) :: (gram_stripped rows')

(** val gramZ : Big.t list list -> Big.t list list **)

let gramZ rows0 =
  gram_stripped (map strip rows0)

type dyadic = Big.t * Big.t

(** val zero : dyadic **)

let zero =
  (Big.zero, Big.zero)

(** val add0 : dyadic -> dyadic -> dyadic **)

let add0 x y =
  let (a, e) = x in
  let (b, f) = y in
  if Big.equal a Big.zero
  then y
  else if Big.equal b Big.zero
       then x
       else if Big.leq e f
            then ((Big.add a
                    ((fun a n -> Big.shift_left a (Big.to_int n)) b
                      (Big.sub f e))), e)
            else ((Big.add
                    ((fun a n -> Big.shift_left a (Big.to_int n)) a
                      (Big.sub e f)) b), f)

(** val mul0 : dyadic -> dyadic -> dyadic **)

let mul0 x y =
  ((Big.mul (fst x) (fst y)), (Big.add (snd x) (snd y)))

(** val neg : dyadic -> dyadic **)

let neg x =
  ((Big.neg (fst x)), (snd x))

(** val abs : dyadic -> dyadic **)

let abs x =
  ((Big.abs (fst x)), (snd x))

(** val shift : Big.t -> dyadic -> dyadic **)

let shift k x =
  ((fst x), (Big.add (snd x) k))

(** val is_nonnegative : dyadic -> bool **)

let is_nonnegative x =
  Big.leq Big.zero (fst x)

(** val is_positive : dyadic -> bool **)

let is_positive x =
  Big.lt Big.zero (fst x)

type matrixD = dyadic list list

type factor = { unit0 : Big.t; scales : Big.t list; rows : Big.t list list }

(** val shift_row : Big.t -> Big.t list -> dyadic list -> dyadic list **)

let rec shift_row k s = function
| [] -> []
| x :: row' ->
  (shift (Big.add k (hd Big.zero s)) x) :: (shift_row k (tl s) row')

(** val congruence : Big.t list -> matrixD -> matrixD **)

let rec congruence s = function
| [] -> []
| row :: p' -> (shift_row (hd Big.zero s) s row) :: (congruence (tl s) p')

(** val remainder : matrixD -> factor -> matrixD **)

let remainder p f =
  sum add0 (congruence f.scales p)
    (map
      (map (fun g -> ((Big.neg g),
        (Big.mul ((fun p -> p) ((fun p -> Big.shift_left p 1) Big.one))
          f.unit0)))) (gramZ f.rows))

(** val total : dyadic list -> dyadic **)

let total u =
  fold_right add0 zero u

(** val dominant : matrixD -> dyadic list -> bool **)

let rec dominant e debts =
  match e with
  | [] -> (match debts with
           | [] -> true
           | _ :: _ -> false)
  | row :: e' ->
    let off = map abs (tl row) in
    (&&)
      (is_nonnegative
        (add0 (hd zero row) (neg (add0 (hd zero debts) (total off)))))
      (dominant e' (plus add0 (tl debts) off))

(** val shows_nonnegative : matrixD -> factor -> bool **)

let shows_nonnegative p f =
  dominant (remainder p f) []

(** val lowest : matrixD -> Big.t **)

let lowest m =
  fold_right (fun row e ->
    fold_right (fun x e0 -> if Big.leq (snd x) e0 then snd x else e0) e row)
    Big.zero m

(** val in_units : Big.t -> dyadic -> Big.t **)

let in_units e x =
  (fun a n -> Big.shift_left a (Big.to_int n)) (fst x) (Big.sub (snd x) e)

(** val gramD : matrixD -> matrixD **)

let gramD m =
  let e = lowest m in
  if forallb (forallb (fun x -> Big.leq e (snd x))) m
  then map
         (map (fun g -> (g,
           (Big.mul ((fun p -> p) ((fun p -> Big.shift_left p 1) Big.one)) e))))
         (gramZ (map (map (in_units e)) m))
  else gram zero add0 mul0 m

(** val norm_inequality : dyadic -> matrixD -> matrixD **)

let norm_inequality rho m =
  sum add0 (diagonal zero (map (fun _ -> rho) m))
    (scale_all mul0 ((Big.neg Big.one), Big.zero) (gramD m))

(** val split : dyadic list -> matrixD list -> dyadic list list **)

let rec split t = function
| [] -> []
| m :: ms' -> (firstn (length m) t) :: (split (skipn (length m) t) ms')

(** val inputs : matrixD list -> matrixD -> int **)

let inputs hidden0 last0 =
  length (hd [] (hd last0 hidden0))

(** val is_zero : dyadic -> bool **)

let is_zero x =
  Big.equal (fst x) Big.zero

type rangeD = dyadic * dyadic

(** val is_unit_range : rangeD -> bool **)

let is_unit_range r =
  (&&) (is_zero (fst r))
    (is_zero (add0 (snd r) ((Big.neg Big.one), Big.zero)))

type relationD = dyadic relation

(** val is_unit_relation : relationD -> bool **)

let is_unit_relation = function
| Each ranges -> forallb is_unit_range ranges
| Grouped (_, _) -> false

(** val is_grouped : relationD -> bool **)

let is_grouped = function
| Each _ -> false
| Grouped (_, _) -> true

(** val multipliers_in : relationD -> matrixD -> int **)

let multipliers_in r m =
  match r with
  | Each _ -> length m
  | Grouped (n, _) -> add n n

(** val multipliers_needed : relationD list -> matrixD list -> int **)

let rec multipliers_needed rs hidden0 =
  match rs with
  | [] ->
    (match hidden0 with
     | [] -> 0
     | m :: hidden' -> add (length m) (multipliers_needed [] hidden'))
  | r :: rs' ->
    (match hidden0 with
     | [] -> 0
     | m :: hidden' ->
       add (multipliers_in r m) (multipliers_needed rs' hidden'))

(** val groups_fit : relationD list -> matrixD list -> bool **)

let rec groups_fit rs hidden0 =
  match rs with
  | [] -> true
  | r :: rs' ->
    (match r with
     | Each _ ->
       (match hidden0 with
        | [] -> true
        | _ :: hidden' -> groups_fit rs' hidden')
     | Grouped (n, k) ->
       (match hidden0 with
        | [] -> true
        | m :: hidden' ->
          (&&) ((=) (length m) (mul n k)) (groups_fit rs' hidden')))

(** val minus_one : dyadic **)

let minus_one =
  ((Big.neg Big.one), Big.zero)

(** val bent_of :
    relationD list -> matrixD list -> dyadic list -> dyadic bent_layer list **)

let rec bent_of rs hidden0 t =
  match rs with
  | [] -> []
  | r :: rs' ->
    (match hidden0 with
     | [] -> []
     | m :: hidden' ->
       (match r with
        | Each ranges -> ((ranges, (firstn (length m) t)), m)
        | Grouped (n, k) ->
          (((repeat (minus_one, (((fun p -> p) Big.one), Big.zero)) (mul n k)),
            (spread k (firstn n t))), m)) :: (bent_of rs' hidden'
                                               (skipn (multipliers_in r m) t)))

(** val pins_of :
    int -> relationD list -> matrixD list -> dyadic list -> dyadic pin list **)

let rec pins_of n rs hidden0 t =
  match rs with
  | [] -> []
  | r :: rs' ->
    (match hidden0 with
     | [] -> []
     | m :: hidden' ->
       (match r with
        | Each _ -> (([], []), (length m))
        | Grouped (g, k) ->
          (((firstn g (skipn g t)),
            (sum_rows zero add0 minus_one n 0 g k m)), (length m))) :: 
         (pins_of (length m) rs' hidden' (skipn (multipliers_in r m) t)))

(** val matrix_inequality :
    relationD list -> matrixD list -> matrixD -> dyadic -> dyadic list ->
    matrixD **)

let matrix_inequality rs hidden0 last0 rho t =
  if forallb is_unit_relation rs
  then (match hidden0 with
        | [] ->
          let n = length (hd [] last0) in
          norm_inequality rho
            (if (<=) (length last0) n then last0 else columns zero n last0)
        | first0 :: later ->
          lmi zero add0 mul0 ((Big.neg Big.one), Big.zero)
            (mul0 (((fun p -> p) Big.one), ((fun p -> p) Big.one)) rho)
            (neg rho) (firstn (length first0) t) first0
            (combine (split (skipn (length first0) t) later) later) last0)
  else let n = inputs hidden0 last0 in
       let bent =
         bent_lmi zero add0 mul0 (((fun p -> p) Big.one), ((fun p -> p)
           Big.one)) ((Big.neg Big.one), Big.zero)
           (repeat (shift (Big.neg Big.one) rho) n) (bent_of rs hidden0 t)
           last0
       in
       if existsb is_grouped rs
       then sum add0 bent (pins zero add0 mul0 n (pins_of n rs hidden0 t))
       else bent

(** val shapes : int -> matrixD list -> matrixD -> bool **)

let rec shapes n hidden0 last0 =
  match hidden0 with
  | [] -> forallb (fun row -> (=) (length row) n) last0
  | m :: hidden' ->
    (&&) (forallb (fun row -> (=) (length row) n) m)
      (shapes (length m) hidden' last0)

(** val check :
    relationD list -> matrixD list -> matrixD -> dyadic -> dyadic -> dyadic
    list -> factor -> bool **)

let check rs hidden0 last0 upper rho t f =
  (&&)
    ((&&) (shapes (inputs hidden0 last0) hidden0 last0)
      (groups_fit rs hidden0))
    ((&&)
      ((&&)
        ((&&)
          ((&&)
            ((&&) ((=) (length t) (multipliers_needed rs hidden0))
              (forallb is_nonnegative t)) (is_positive rho))
          (is_nonnegative upper))
        (is_nonnegative (add0 (mul0 upper upper) (neg rho))))
      (shows_nonnegative (matrix_inequality rs hidden0 last0 rho t) f))

type stack = matrixD list * matrixD

type layerD = matrixD * dyadic list

type part = { hidden : layerD list; outer : layerD;
              clamp : (dyadic * dyadic) list; between : activation list }

(** val no_part : part **)

let no_part =
  { hidden = []; outer = ([], []); clamp = []; between = [] }

(** val part_at : part list -> int -> part **)

let part_at ps k =
  nth k ps no_part

(** val layers : part -> layerD list **)

let layers p =
  app p.hidden (p.outer :: [])

(** val inputs_of : part -> int **)

let inputs_of p =
  length (hd [] (fst (hd p.outer p.hidden)))

type function0 =
| Alone of int
| Set_of of int * int

(** val moved : function0 -> int **)

let moved = function
| Alone p -> p
| Set_of (phi0, _) -> phi0

(** val count_of : int -> int list -> int **)

let count_of p those =
  length (filter ((=) p) those)

(** val same_terms : int list -> int list -> bool **)

let same_terms a b =
  forallb (fun p -> (=) (count_of p a) (count_of p b)) (app a b)

(** val is_silent : int list list -> int list -> bool **)

let is_silent silent those =
  existsb (same_terms those) silent

(** val outputs_of : part -> int **)

let outputs_of p =
  length (fst p.outer)

(** val one : dyadic **)

let one =
  (((fun p -> p) Big.one), Big.zero)

type kind = (int * bool list) * Big.t

type box = (dyadic * dyadic) list

type term = { phi : int; inputs_in : box; fewest : Big.t; most : Big.t }

(** val box_of : (int * box) list -> int -> box option **)

let rec box_of boxes p =
  match boxes with
  | [] -> None
  | p0 :: boxes' ->
    let (q, b) = p0 in if (=) p q then Some b else box_of boxes' p

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

(** val steepest : activation -> dyadic **)

let rec steepest = function
| Sigmoid ->
  (((fun p -> p) Big.one), (Big.neg ((fun p -> Big.shift_left p 1) Big.one)))
| Selu ->
  (((fun p -> p) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    Big.one))))))))))))))))))))))))))))))))))))))))))))))))))))), (Big.neg
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) Big.one)))))))
| Silu ->
  (((fun p -> p) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    Big.one))))))))))))))))), (Big.neg ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) Big.one))))))
| Gelu ->
  (((fun p -> p) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) Big.one))))))))))))), (Big.neg
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) Big.one)))))
| Keeping (_, b) ->
  if is_nonnegative (add0 (steepest b) (neg one)) then steepest b else one
| _ -> one

(** val is_rising : activation -> bool **)

let is_rising = function
| Silu -> false
| Gelu -> false
| _ -> true

(** val is_entrywise : activation -> bool **)

let is_entrywise = function
| Sorted _ -> false
| Keeping (_, _) -> false
| _ -> true

(** val changes_numbers : activation -> bool **)

let changes_numbers a =
  is_entrywise (base a)

(** val is_relu : activation -> bool **)

let is_relu = function
| Relu -> true
| _ -> false

(** val range_of : activation -> rangeD **)

let range_of a =
  ((if is_rising a then zero else add0 one (neg (steepest a))), (steepest a))

(** val kept_range : rangeD **)

let kept_range =
  ((add0 one ((Big.neg Big.one), (Big.neg ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1)) Big.one))))))), one)

(** val unit_of : activation -> dyadic **)

let unit_of a =
  if is_rising a then steepest a else one

(** val divided_range : activation -> rangeD **)

let divided_range a =
  if is_rising a then (zero, one) else range_of a

(** val set_stages :
    matrixD list -> matrixD -> matrixD list -> matrixD -> matrixD
    list * matrixD **)

let set_stages phi0 w rho last0 =
  match rho with
  | [] -> (phi0, (product zero add0 mul0 last0 w))
  | v :: rho' -> ((app phi0 ((product zero add0 mul0 v w) :: rho')), last0)

(** val outputs : matrixD list -> int -> int **)

let outputs hidden0 n =
  length (last hidden0 (repeat [] n))

(** val check_parts :
    relationD list -> stack -> stack list -> dyadic -> dyadic -> dyadic list
    -> factor -> bool **)

let rec check_parts rs p ps upper r t f =
  match ps with
  | [] -> check rs (fst p) (snd p) upper r t f
  | q :: ps' ->
    let joined = set_stages (fst p) (snd p) (fst q) (snd q) in
    let n = inputs (fst p) (snd p) in
    (&&)
      ((&&)
        ((&&)
          ((&&) ((=) (length (hd [] (snd p))) (outputs (fst p) n))
            ((=) (inputs (fst joined) (snd joined)) n))
          (shapes n (fst p) (snd p)))
        (shapes (length (snd p)) (fst q) (snd q)))
      (check_parts rs joined ps' upper r t f)

(** val count : bool list -> int **)

let rec count = function
| [] -> 0
| b :: m -> if b then Stdlib.Int.succ (count m) else count m

(** val selector : bool list -> dyadic list -> matrixD **)

let rec selector moves scale0 =
  match moves with
  | [] -> []
  | b :: m ->
    if b
    then ((hd one scale0) :: (repeat zero (count m))) :: (map (fun x ->
                                                           zero :: x)
                                                           (selector m
                                                             (tl scale0)))
    else (repeat zero (count m)) :: (selector m (tl scale0))

(** val positive_scale : dyadic list -> bool **)

let positive_scale scale0 =
  forallb is_positive scale0

(** val reluD : dyadic -> dyadic **)

let reluD x =
  if is_nonnegative x then x else zero

(** val minusD : dyadic list -> dyadic list -> dyadic list **)

let minusD u v =
  plus add0 u (scale mul0 ((Big.neg Big.one), Big.zero) v)

(** val squareD : dyadic list -> dyadic **)

let squareD u =
  dot zero add0 mul0 u u

type fixed = Big.t * Big.t

(** val unit_of_fixed : Big.t **)

let unit_of_fixed =
  (fun a n -> Big.shift_left a (Big.to_int n)) ((fun p -> p) Big.one)
    ((fun p -> p) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) Big.one)))))))))

(** val least : Big.t -> Big.t -> Big.t **)

let least a b =
  if Big.leq a b then a else b

(** val greatest : Big.t -> Big.t -> Big.t **)

let greatest a b =
  if Big.leq a b then b else a

(** val ceil_shift : Big.t -> Big.t -> Big.t **)

let ceil_shift a n =
  Big.neg ((fun a n -> Big.shift_right a (Big.to_int n)) (Big.neg a) n)

(** val ceil_quotient : Big.t -> Big.t -> Big.t **)

let ceil_quotient a b =
  Big.neg (Big.fdiv (Big.neg a) b)

(** val floor_at : Big.t -> dyadic -> Big.t **)

let floor_at u x =
  let e = Big.sub (snd x) u in
  if Big.leq Big.zero e
  then (fun a n -> Big.shift_left a (Big.to_int n)) (fst x) e
  else (fun a n -> Big.shift_right a (Big.to_int n)) (fst x) (Big.neg e)

(** val ceil_at : Big.t -> dyadic -> Big.t **)

let ceil_at u x =
  Big.neg (floor_at u (neg x))

(** val floor_to : Big.t -> dyadic -> dyadic **)

let floor_to u x =
  if Big.leq u (snd x) then x else ((floor_at u x), u)

(** val ceil_to : Big.t -> dyadic -> dyadic **)

let ceil_to u x =
  if Big.leq u (snd x) then x else ((ceil_at u x), u)

(** val of_dyadic : dyadic -> fixed **)

let of_dyadic x =
  ((floor_at (Big.neg ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) Big.one))))))))) x),
    (ceil_at (Big.neg ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) Big.one))))))))) x))

(** val oneF : fixed **)

let oneF =
  (unit_of_fixed, unit_of_fixed)

(** val addF : fixed -> fixed -> fixed **)

let addF a b =
  ((Big.add (fst a) (fst b)), (Big.add (snd a) (snd b)))

(** val negF : fixed -> fixed **)

let negF a =
  ((Big.neg (snd a)), (Big.neg (fst a)))

(** val mulF : fixed -> fixed -> fixed **)

let mulF a b =
  let (l, h) = a in
  let (m, k) = b in
  let p = Big.mul l m in
  let q = Big.mul l k in
  let r = Big.mul h m in
  let s = Big.mul h k in
  (((fun a n -> Big.shift_right a (Big.to_int n))
     (least (least p q) (least r s)) ((fun p -> p)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     Big.one)))))))))),
  (ceil_shift (greatest (greatest p q) (greatest r s)) ((fun p -> p)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    Big.one)))))))))))

(** val overF : fixed -> Big.t -> fixed **)

let overF a n =
  ((Big.fdiv (fst a) n), (ceil_quotient (snd a) n))

(** val ratioF : Big.t -> Big.t -> fixed **)

let ratioF n d =
  ((Big.fdiv
     ((fun a n -> Big.shift_left a (Big.to_int n)) n ((fun p -> p)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       Big.one)))))))))) d),
    (ceil_quotient
      ((fun a n -> Big.shift_left a (Big.to_int n)) n ((fun p -> p)
        ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
        Big.one)))))))))) d))

(** val divF : fixed -> fixed -> fixed **)

let divF a b =
  let l =
    (fun a n -> Big.shift_left a (Big.to_int n)) (fst a) ((fun p -> p)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      Big.one)))))))))
  in
  let h =
    (fun a n -> Big.shift_left a (Big.to_int n)) (snd a) ((fun p -> p)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      Big.one)))))))))
  in
  let m = greatest unit_of_fixed (fst b) in
  let k = greatest unit_of_fixed (snd b) in
  ((Big.fdiv l (if Big.leq Big.zero l then k else m)),
  (ceil_quotient h (if Big.leq Big.zero h then m else k)))

(** val exp_series : int -> Big.t -> fixed -> fixed -> fixed -> fixed **)

let rec exp_series n k y term0 sum0 =
  (fun fO fS n -> if n=0 then fO () else fS (n-1))
    (fun _ -> sum0)
    (fun n' ->
    let t = overF (mulF term0 y) k in
    exp_series n' (Big.add k ((fun p -> p) Big.one)) y t (addF sum0 t))
    n

(** val squares : int -> fixed -> fixed **)

let rec squares n f =
  (fun fO fS n -> if n=0 then fO () else fS (n-1))
    (fun _ -> f)
    (fun n' -> squares n' (mulF f f))
    n

(** val vanishing : Big.t **)

let vanishing =
  Big.mul ((fun p -> p) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    Big.one)))))))) unit_of_fixed

(** val exp_by_series : fixed -> fixed **)

let exp_by_series x =
  let sum0 =
    exp_series (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ 0)))))))))))))))))))))))))))))))) ((fun p -> p)
      Big.one)
      (((fun a n -> Big.shift_right a (Big.to_int n)) (fst x) ((fun p -> p)
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.succ (Big.shift_left p 1)) Big.one))))),
      (ceil_shift (snd x) ((fun p -> p) ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.succ (Big.shift_left p 1)) Big.one)))))) oneF oneF
  in
  squares (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    0))))))))))))
    (divF oneF ((fst sum0), (Big.add (snd sum0) ((fun p -> p) Big.one))))

(** val exp_of_minus : fixed -> fixed **)

let exp_of_minus x =
  if Big.leq vanishing (fst x)
  then (Big.zero, ((fun p -> p) Big.one))
  else if Big.leq vanishing (snd x)
       then (Big.zero, (snd (exp_by_series ((fst x), vanishing))))
       else exp_by_series x

(** val at_most : dyadic -> dyadic -> bool **)

let at_most x y =
  is_nonnegative (add0 y (neg x))

(** val clampedD : (dyadic * dyadic) list -> dyadic list -> dyadic list **)

let rec clampedD c x =
  match c with
  | [] -> x
  | p :: c' ->
    let (low, high) = p in
    (match x with
     | [] -> x
     | a :: x' ->
       let b = if at_most a low then low else a in
       (if at_most b high then b else high) :: (clampedD c' x'))

(** val same : dyadic -> dyadic -> bool **)

let same x y =
  (&&) (Big.equal (fst x) (fst y)) (Big.equal (snd x) (snd y))

(** val same_numbers : dyadic list -> dyadic list -> bool **)

let rec same_numbers x y =
  match x with
  | [] -> (match y with
           | [] -> true
           | _ :: _ -> false)
  | a :: x' ->
    (match y with
     | [] -> false
     | b :: y' -> (&&) (same a b) (same_numbers x' y'))

(** val same_box : box -> box -> bool **)

let rec same_box x y =
  match x with
  | [] -> (match y with
           | [] -> true
           | _ :: _ -> false)
  | a :: x' ->
    (match y with
     | [] -> false
     | b :: y' ->
       (&&) ((&&) (same (fst a) (fst b)) (same (snd a) (snd b)))
         (same_box x' y'))

(** val contains : box -> box -> bool **)

let rec contains a b =
  match a with
  | [] -> (match b with
           | [] -> true
           | _ :: _ -> false)
  | p :: a' ->
    let (l, h) = p in
    (match b with
     | [] -> false
     | p0 :: b' ->
       let (l', h') = p0 in
       (&&) ((&&) (at_most l l') (at_most h' h)) (contains a' b'))

(** val clamp_ends : (dyadic * dyadic) list -> box -> box **)

let clamp_ends c b =
  combine (clampedD c (map fst b)) (clampedD c (map snd b))

(** val relu_ends : (dyadic * dyadic) -> dyadic * dyadic **)

let relu_ends i =
  ((reluD (fst i)), (reluD (snd i)))

(** val larger : dyadic -> dyadic -> dyadic **)

let larger x y =
  if at_most x y then y else x

(** val largest_abs : (dyadic * dyadic) -> dyadic **)

let largest_abs i =
  larger (abs (fst i)) (abs (snd i))

(** val row_ends : dyadic list -> box -> dyadic * dyadic **)

let rec row_ends row b =
  match row with
  | [] -> (zero, zero)
  | w :: row' ->
    (match b with
     | [] -> (zero, zero)
     | p :: b' ->
       let (l, h) = p in
       let (s, t) = row_ends row' b' in
       if is_nonnegative w
       then ((add0 (mul0 w l) s), (add0 (mul0 w h) t))
       else ((add0 (mul0 w h) s), (add0 (mul0 w l) t)))

(** val encloses : matrixD -> dyadic list -> box -> box -> bool **)

let rec encloses w c b v =
  match w with
  | [] ->
    (match c with
     | [] -> (match v with
              | [] -> true
              | _ :: _ -> false)
     | _ :: _ -> false)
  | row :: w' ->
    (match c with
     | [] -> false
     | a :: c' ->
       (match v with
        | [] -> false
        | p :: v' ->
          let (l, h) = p in
          let (s, t) = row_ends row b in
          (&&) ((&&) (at_most l (add0 s a)) (at_most (add0 t a) h))
            (encloses w' c' b v')))

(** val check_layers :
    layerD list -> layerD -> box -> box list -> box -> bool **)

let rec check_layers hidden0 last0 b bounds0 v =
  match hidden0 with
  | [] ->
    (match bounds0 with
     | [] -> encloses (fst last0) (snd last0) b v
     | _ :: _ -> false)
  | l :: hidden' ->
    (match bounds0 with
     | [] -> false
     | c :: bounds' ->
       (&&) (encloses (fst l) (snd l) b c)
         (check_layers hidden' last0 (map relu_ends c) bounds' v))

(** val sizes : box -> dyadic list -> dyadic list **)

let rec sizes b r =
  match b with
  | [] -> []
  | i :: b' ->
    (match r with
     | [] -> []
     | a :: r' -> (add0 (largest_abs i) a) :: (sizes b' r'))

(** val size0 : 'a1 list -> Big.t **)

let rec size0 = function
| [] -> Big.zero
| _ :: l' -> Big.add ((fun p -> p) Big.one) (size0 l')

(** val gammaD : Big.t -> dyadic **)

let gammaD n =
  let x = (n, (Big.neg ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) Big.one))))))
  in
  add0 x (mul0 x x)

(** val any_rounding : Big.t -> dyadic -> dyadic option **)

let any_rounding n m =
  if (&&)
       (Big.leq n ((fun p -> p) ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         Big.one)))))))))))))))))))))))))
       (at_most
         (add0 m (n, (Big.neg ((fun p -> Big.succ (Big.shift_left p 1))
           ((fun p -> Big.shift_left p 1)
           ((fun p -> Big.succ (Big.shift_left p 1))
           ((fun p -> Big.shift_left p 1)
           ((fun p -> Big.succ (Big.shift_left p 1))
           ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
           Big.one)))))))))) (((fun p -> p) Big.one), ((fun p -> p)
         ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.succ (Big.shift_left p 1))
         ((fun p -> Big.succ (Big.shift_left p 1))
         ((fun p -> Big.succ (Big.shift_left p 1))
         ((fun p -> Big.succ (Big.shift_left p 1))
         ((fun p -> Big.succ (Big.shift_left p 1)) Big.one)))))))))
  then Some
         (add0 (mul0 (gammaD n) m) (n, (Big.neg
           ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
           ((fun p -> Big.succ (Big.shift_left p 1))
           ((fun p -> Big.shift_left p 1)
           ((fun p -> Big.succ (Big.shift_left p 1))
           ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
           Big.one))))))))))
  else None

(** val rounding_fits : Big.t -> dyadic -> dyadic -> dyadic -> bool **)

let rounding_fits n m before e =
  match any_rounding n m with
  | Some d -> at_most (add0 before d) e
  | None -> false

(** val one_rounding : dyadic -> dyadic **)

let one_rounding m =
  if is_positive m
  then add0 (((fun p -> p) Big.one),
         (Big.sub
           (Big.add (snd m) ((fun a -> Big.of_int (Big.log2 a)) (fst m)))
           ((fun p -> p) ((fun p -> Big.shift_left p 1)
           ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
           ((fun p -> Big.succ (Big.shift_left p 1)) Big.one)))))))
         (((fun p -> p) Big.one), (Big.neg ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.succ (Big.shift_left p 1))
         ((fun p -> Big.succ (Big.shift_left p 1))
         ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.succ (Big.shift_left p 1))
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         Big.one)))))))))
  else (((fun p -> p) Big.one), (Big.neg ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.succ (Big.shift_left p 1))
         ((fun p -> Big.succ (Big.shift_left p 1))
         ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.succ (Big.shift_left p 1))
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         Big.one)))))))))

(** val ordered_rounding :
    dyadic list -> box -> (dyadic * dyadic) -> dyadic -> dyadic option **)

let rec ordered_rounding row h s off =
  match row with
  | [] -> Some off
  | w :: row' ->
    (match h with
     | [] -> Some off
     | i :: h' ->
       let p =
         if is_nonnegative w
         then ((mul0 w (fst i)), (mul0 w (snd i)))
         else ((mul0 w (snd i)), (mul0 w (fst i)))
       in
       let t = ((add0 (fst s) (fst p)), (add0 (snd s) (snd p))) in
       let d = add0 off (one_rounding (largest_abs p)) in
       let m = add0 (largest_abs t) d in
       if at_most (add0 (largest_abs p) m) (((fun p -> p) Big.one),
            ((fun p -> p) ((fun p -> Big.shift_left p 1)
            ((fun p -> Big.succ (Big.shift_left p 1))
            ((fun p -> Big.succ (Big.shift_left p 1))
            ((fun p -> Big.succ (Big.shift_left p 1))
            ((fun p -> Big.succ (Big.shift_left p 1))
            ((fun p -> Big.succ (Big.shift_left p 1)) Big.one))))))))
       then ordered_rounding row' h' t
              (ceil_to (Big.neg ((fun p -> Big.shift_left p 1)
                ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
                ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
                ((fun p -> Big.succ (Big.shift_left p 1))
                ((fun p -> Big.shift_left p 1) Big.one))))))))
                (add0 d (one_rounding m)))
       else None)

(** val widened : box -> dyadic list -> box **)

let rec widened b r =
  match b with
  | [] -> []
  | p :: b' ->
    let (l, h) = p in
    (match r with
     | [] -> []
     | a :: r' -> ((add0 l (neg a)), (add0 h a)) :: (widened b' r'))

(** val layer_roundings :
    bool -> matrixD -> dyadic list -> box -> dyadic list -> dyadic list option **)

let rec layer_roundings in_order w c h m =
  match w with
  | [] -> (match c with
           | [] -> Some []
           | _ :: _ -> None)
  | row :: w' ->
    (match c with
     | [] -> None
     | a :: c' ->
       let d =
         if in_order
         then ordered_rounding row h (a, a) zero
         else any_rounding (Big.add ((fun p -> p) Big.one) (size0 row))
                (add0 (abs a) (dot zero add0 mul0 (map abs row) m))
       in
       (match d with
        | Some x ->
          (match layer_roundings in_order w' c' h m with
           | Some ds -> Some (x :: ds)
           | None -> None)
        | None -> None))

(** val errors_fit :
    matrixD -> dyadic list -> dyadic list -> dyadic list -> bool **)

let rec errors_fit w r ds e =
  match w with
  | [] ->
    (match ds with
     | [] -> (match e with
              | [] -> true
              | _ :: _ -> false)
     | _ :: _ -> false)
  | row :: w' ->
    (match ds with
     | [] -> false
     | d :: ds' ->
       (match e with
        | [] -> false
        | x :: e' ->
          (&&) (at_most (add0 (dot zero add0 mul0 (map abs row) r) d) x)
            (errors_fit w' r ds' e')))

(** val norm_fits : dyadic -> dyadic -> dyadic -> dyadic list -> bool **)

let norm_fits n off x ds =
  let d = add0 x (neg (mul0 n off)) in
  (&&) (is_nonnegative d) (at_most (squareD ds) (mul0 d d))

(** val check_roundings :
    bool -> layerD list -> layerD -> box -> dyadic list -> box list -> dyadic
    list list -> dyadic list -> dyadic list -> dyadic -> dyadic list ->
    dyadic -> bool **)

let rec check_roundings in_order hidden0 last0 b r bounds0 errors e norms0 off offs u =
  let fits = fun l n x s ->
    match layer_roundings in_order (fst l) (snd l) (widened b r) (sizes b r) with
    | Some ds -> (&&) (errors_fit (fst l) r ds s) (norm_fits n off x ds)
    | None -> false
  in
  (match hidden0 with
   | [] ->
     (match bounds0 with
      | [] ->
        (match errors with
         | [] ->
           (match norms0 with
            | [] -> false
            | n :: l ->
              (match l with
               | [] ->
                 (match offs with
                  | [] -> fits last0 n u e
                  | _ :: _ -> false)
               | _ :: _ -> false))
         | _ :: _ -> false)
      | _ :: _ -> false)
   | l :: hidden' ->
     (match bounds0 with
      | [] -> false
      | c :: bounds' ->
        (match errors with
         | [] -> false
         | s :: errors' ->
           (match norms0 with
            | [] -> false
            | n :: norms' ->
              (match offs with
               | [] -> false
               | x :: offs' ->
                 (&&) ((&&) (encloses (fst l) (snd l) b c) (fits l n x s))
                   (check_roundings in_order hidden' last0 (map relu_ends c)
                     s bounds' errors' e norms' x offs' u))))))

(** val add_ends : Big.t -> Big.t -> box -> box -> box **)

let rec add_ends low high v s =
  match v with
  | [] -> []
  | p :: v' ->
    let (l, h) = p in
    (match s with
     | [] -> []
     | p0 :: s' ->
       let (a, b) = p0 in
       ((add0 (mul0 ((if is_nonnegative l then low else high), Big.zero) l) a),
       (add0 (mul0 ((if is_nonnegative h then high else low), Big.zero) h) b)) :: 
       (add_ends low high v' s'))

(** val sum_fits :
    Big.t -> dyadic list -> dyadic list -> dyadic list -> bool **)

let rec sum_fits count0 m e errors =
  match m with
  | [] ->
    (match e with
     | [] -> (match errors with
              | [] -> true
              | _ :: _ -> false)
     | _ :: _ -> false)
  | a :: m' ->
    (match e with
     | [] -> false
     | b :: e' ->
       (match errors with
        | [] -> false
        | x :: errors' ->
          (&&) (rounding_fits count0 a b x) (sum_fits count0 m' e' errors')))

(** val in_words : Big.t list -> Big.t **)

let in_words words =
  fold_left (fun n w ->
    Big.add
      ((fun a n -> Big.shift_left a (Big.to_int n)) n ((fun p -> p)
        ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
        Big.one)))))))) w) words Big.zero

(** val inverse_rootF : fixed **)

let inverse_rootF =
  ((in_words (((fun p -> p) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     Big.one))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))) :: (((fun p -> p)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     Big.one)))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))) :: (((fun p -> p)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     Big.one)))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))) :: (((fun p -> p)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
     ((fun p -> Big.succ (Big.shift_left p 1))
     Big.one)))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))) :: []))))),
    (in_words (((fun p -> p) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      Big.one))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))) :: (((fun p -> p)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      Big.one)))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))) :: (((fun p -> p)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      Big.one)))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))) :: (((fun p -> p)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1))
      Big.one)))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))) :: []))))))

(** val normal_series :
    int -> Big.t -> fixed -> fixed -> fixed -> (Big.t * fixed) * fixed **)

let rec normal_series n k square term0 sum0 =
  (fun fO fS n -> if n=0 then fO () else fS (n-1))
    (fun _ -> ((k, term0), sum0))
    (fun n' ->
    if Big.leq (snd term0) ((fun p -> p) Big.one)
    then ((k, term0), sum0)
    else let t = overF (mulF term0 square) k in
         normal_series n'
           (Big.add k ((fun p -> p) ((fun p -> Big.shift_left p 1) Big.one)))
           square t (addF sum0 t))
    n

(** val halfF : fixed **)

let halfF =
  (((fun a n -> Big.shift_left a (Big.to_int n)) ((fun p -> p) Big.one)
     ((fun p -> p) ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1))
     ((fun p -> Big.succ (Big.shift_left p 1)) Big.one))))))))),
    ((fun a n -> Big.shift_left a (Big.to_int n)) ((fun p -> p) Big.one)
      ((fun p -> p) ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1))
      ((fun p -> Big.succ (Big.shift_left p 1)) Big.one))))))))))

(** val densityF : fixed -> fixed **)

let densityF x =
  let s = mulF x x in
  mulF
    (exp_of_minus
      (overF ((greatest Big.zero (fst s)), (snd s)) ((fun p -> p)
        ((fun p -> Big.shift_left p 1) Big.one)))) inverse_rootF

(** val most_terms : int **)

let most_terms =
  mul (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    0)))))))))))))))))))) (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    0))))))))))))))))))))))))))))))

(** val far : Big.t **)

let far =
  Big.mul ((fun p -> p) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) Big.one)))) unit_of_fixed

(** val probability_of_positive : fixed -> fixed **)

let probability_of_positive x =
  if Big.leq far (fst x)
  then ((Big.sub unit_of_fixed
          ((fun a n -> Big.shift_left a (Big.to_int n)) ((fun p -> p)
            Big.one) ((fun p -> p) ((fun p -> Big.succ (Big.shift_left p 1))
            ((fun p -> Big.succ (Big.shift_left p 1))
            ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
            ((fun p -> Big.succ (Big.shift_left p 1))
            ((fun p -> Big.succ (Big.shift_left p 1)) Big.one))))))))),
         unit_of_fixed)
  else let square = mulF x x in
       let (p, sum0) =
         normal_series most_terms ((fun p -> p)
           ((fun p -> Big.succ (Big.shift_left p 1)) Big.one)) square x x
       in
       let (k, term0) = p in
       let p0 =
         addF halfF
           (mulF (densityF x) ((fst sum0), (Big.add (snd sum0) (snd term0))))
       in
       ((fst p0),
       (if Big.leq
             (Big.mul ((fun p -> p) ((fun p -> Big.shift_left p 1) Big.one))
               (snd square))
             (Big.mul
               (Big.sub k ((fun p -> p) ((fun p -> Big.shift_left p 1)
                 Big.one))) unit_of_fixed)
        then least (snd p0) unit_of_fixed
        else unit_of_fixed))

(** val probabilityF : dyadic -> fixed **)

let probabilityF t =
  let p = probability_of_positive (of_dyadic (abs t)) in
  if is_nonnegative t then p else addF oneF (negF p)

(** val log_series : int -> Big.t -> fixed -> fixed -> fixed -> fixed **)

let rec log_series n k square power sum0 =
  (fun fO fS n -> if n=0 then fO () else fS (n-1))
    (fun _ -> sum0)
    (fun n' ->
    log_series n'
      (Big.add k ((fun p -> p) ((fun p -> Big.shift_left p 1) Big.one)))
      square (mulF power square) (addF sum0 (overF power k)))
    n

(** val confirmed_log : Big.t -> Big.t -> fixed -> fixed **)

let confirmed_log low high e =
  let square =
    (fun a n -> Big.shift_left a (Big.to_int n)) unit_of_fixed ((fun p -> p)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      Big.one)))))))))
  in
  ((if (&&) (Big.leq Big.zero low)
         (Big.leq square
           (Big.mul (fst (exp_of_minus (low, low)))
             (Big.add unit_of_fixed (greatest Big.zero (fst e)))))
    then low
    else Big.zero),
  (if (&&) (Big.leq Big.zero high)
        (Big.leq
          (Big.mul (snd (exp_of_minus (high, high)))
            (Big.add unit_of_fixed (snd e))) square)
   then high
   else snd e))

(** val log_of_one_plus : fixed -> fixed **)

let log_of_one_plus e =
  let z0 = divF e (addF (addF oneF oneF) e) in
  let c =
    log_series (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
      (Stdlib.Int.succ (Stdlib.Int.succ
      0)))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))
      ((fun p -> p) Big.one) (mulF z0 z0) z0 (Big.zero, Big.zero)
  in
  confirmed_log
    (Big.sub
      (Big.mul ((fun p -> p) ((fun p -> Big.shift_left p 1) Big.one)) (fst c))
      ((fun a n -> Big.shift_left a (Big.to_int n)) ((fun p -> p) Big.one)
        ((fun p -> p) ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.succ (Big.shift_left p 1))
        ((fun p -> Big.succ (Big.shift_left p 1))
        ((fun p -> Big.succ (Big.shift_left p 1)) Big.one))))))))
    (Big.add
      (Big.mul ((fun p -> p) ((fun p -> Big.shift_left p 1) Big.one)) (snd c))
      ((fun a n -> Big.shift_left a (Big.to_int n)) ((fun p -> p) Big.one)
        ((fun p -> p) ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.succ (Big.shift_left p 1))
        ((fun p -> Big.succ (Big.shift_left p 1))
        ((fun p -> Big.succ (Big.shift_left p 1)) Big.one)))))))) e

(** val selu_scaleF : fixed **)

let selu_scaleF =
  ratioF ((fun p -> p) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1)
    Big.one))))))))))))))))))))))))))))))))))))))))))))))))))))))
    ((fun p -> p) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    Big.one))))))))))))))))))))))))))))))))))))))))))))))))))))))

(** val selu_alphaF : fixed **)

let selu_alphaF =
  ratioF ((fun p -> p) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    Big.one))))))))))))))))))))))))))))))))))))))))))))))))))))))
    ((fun p -> p) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    Big.one))))))))))))))))))))))))))))))))))))))))))))))))))))))

(** val exp_of_minus_size : dyadic -> fixed **)

let exp_of_minus_size t =
  exp_of_minus (of_dyadic (abs t))

(** val sigmoidF : dyadic -> fixed **)

let sigmoidF t =
  let e = exp_of_minus_size t in
  divF (if is_nonnegative t then oneF else e) (addF oneF e)

(** val tanhF : dyadic -> fixed **)

let tanhF t =
  let e = exp_of_minus_size (shift ((fun p -> p) Big.one) t) in
  let v = divF (addF oneF (negF e)) (addF oneF e) in
  if is_nonnegative t then v else negF v

(** val softplusF : dyadic -> fixed **)

let softplusF t =
  addF (if is_nonnegative t then of_dyadic t else (Big.zero, Big.zero))
    (log_of_one_plus (exp_of_minus_size t))

(** val eluF : dyadic -> fixed **)

let eluF t =
  if is_nonnegative t
  then of_dyadic t
  else addF (exp_of_minus_size t) (negF oneF)

(** val seluF : dyadic -> fixed **)

let seluF t =
  mulF selu_scaleF
    (if is_nonnegative t
     then of_dyadic t
     else mulF selu_alphaF (addF (exp_of_minus_size t) (negF oneF)))

(** val value_at : activation -> dyadic -> fixed **)

let value_at a t =
  match a with
  | Tanh -> tanhF t
  | Sigmoid -> sigmoidF t
  | Softplus -> softplusF t
  | Elu -> eluF t
  | Selu -> seluF t
  | Silu -> mulF (of_dyadic t) (sigmoidF t)
  | Gelu -> mulF (of_dyadic t) (probabilityF t)
  | _ -> (Big.zero, Big.zero)

(** val minimum_of : activation -> (dyadic * dyadic) * dyadic **)

let minimum_of = function
| Gelu ->
  ((((Big.neg ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) Big.one))))))))))))))))))))),
    (Big.neg ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) Big.one)))))), ((Big.neg
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) Big.one))))))))))))))))))))),
    (Big.neg ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) Big.one))))))), ((Big.neg
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    Big.one))))))))))))))))))))), (Big.neg
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    Big.one)))))))
| _ ->
  ((((Big.neg ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    Big.one))))))))))))))))))))), (Big.neg ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) Big.one)))))), ((Big.neg
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    Big.one))))))))))))))))))))), (Big.neg ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) Big.one))))))), ((Big.neg
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    Big.one))))))))))))))))), (Big.neg ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) Big.one)))))))

(** val smaller : dyadic -> dyadic -> dyadic **)

let smaller x y =
  if at_most x y then x else y

(** val below : dyadic -> dyadic -> bool **)

let below x y =
  negb (at_most y x)

(** val values_between :
    activation -> (dyadic * dyadic) -> dyadic * dyadic **)

let values_between a i =
  let v = value_at a (fst i) in
  let w = if same (fst i) (snd i) then v else value_at a (snd i) in
  let low = ((fst v), (Big.neg ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) Big.one))))))))))
  in
  let high = ((snd w), (Big.neg ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) Big.one))))))))))
  in
  if is_rising a
  then ((floor_to (Big.neg ((fun p -> Big.shift_left p 1)
          ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
          ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
          ((fun p -> Big.shift_left p 1) Big.one))))))) low),
         (ceil_to (Big.neg ((fun p -> Big.shift_left p 1)
           ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
           ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
           ((fun p -> Big.shift_left p 1) Big.one))))))) high))
  else let (p, value) = minimum_of a in
       let (from, to0) = p in
       ((floor_to (Big.neg ((fun p -> Big.shift_left p 1)
          ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
          ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
          ((fun p -> Big.shift_left p 1) Big.one)))))))
          (if (||) (below (snd i) from) (below to0 (fst i))
           then smaller low ((fst w), (Big.neg ((fun p -> Big.shift_left p 1)
                  ((fun p -> Big.shift_left p 1)
                  ((fun p -> Big.shift_left p 1)
                  ((fun p -> Big.shift_left p 1)
                  ((fun p -> Big.shift_left p 1)
                  ((fun p -> Big.shift_left p 1)
                  ((fun p -> Big.shift_left p 1)
                  ((fun p -> Big.shift_left p 1) Big.one))))))))))
           else value)),
       (ceil_to (Big.neg ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.shift_left p 1) Big.one)))))))
         (larger high ((snd v), (Big.neg ((fun p -> Big.shift_left p 1)
           ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
           ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
           ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
           ((fun p -> Big.shift_left p 1) Big.one)))))))))))))

(** val least_ends :
    (dyadic * dyadic) -> (dyadic * dyadic) -> dyadic * dyadic **)

let least_ends i j =
  ((smaller (fst i) (fst j)), (smaller (snd i) (snd j)))

(** val greatest_ends :
    (dyadic * dyadic) -> (dyadic * dyadic) -> dyadic * dyadic **)

let greatest_ends i j =
  ((larger (fst i) (fst j)), (larger (snd i) (snd j)))

(** val activated_ends : activation -> box -> box **)

let rec activated_ends a b =
  match a with
  | Relu -> map relu_ends b
  | Sorted s -> sorted_by least_ends greatest_ends s b
  | Keeping (n, c) -> app (activated_ends c (firstn n b)) (skipn n b)
  | _ -> map (values_between a) b

(** val plus_ends : box -> box -> box **)

let rec plus_ends a b =
  match a with
  | [] -> b
  | p :: a' ->
    let (l, h) = p in
    (match b with
     | [] -> a
     | p0 :: b' ->
       let (m, k) = p0 in ((add0 l m), (add0 h k)) :: (plus_ends a' b'))

(** val affine_ends : layerD -> box -> box **)

let affine_ends l b =
  plus_ends (map (fun row -> row_ends row b) (fst l))
    (map (fun c -> (c, c)) (snd l))

(** val network_ends :
    activation list -> layerD list -> layerD -> box -> box **)

let rec network_ends between0 hidden0 last0 b =
  match hidden0 with
  | [] -> affine_ends last0 b
  | l :: hidden' ->
    network_ends (tl between0) hidden' last0
      (activated_ends (hd Relu between0) (affine_ends l b))

(** val gelu_slopeF : dyadic -> fixed **)

let gelu_slopeF t =
  addF (probabilityF t) (mulF (of_dyadic t) (densityF (of_dyadic (abs t))))

(** val bumpF : fixed -> fixed **)

let bumpF e =
  divF e (mulF (addF oneF e) (addF oneF e))

(** val is_below_zero : dyadic -> bool **)

let is_below_zero x =
  negb (is_nonnegative x)

(** val slope_at : activation -> dyadic -> fixed **)

let slope_at a t =
  match a with
  | Tanh ->
    mulF
      ((Big.mul ((fun p -> p) ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.shift_left p 1) Big.one))) unit_of_fixed),
      (Big.mul ((fun p -> p) ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.shift_left p 1) Big.one))) unit_of_fixed))
      (bumpF (exp_of_minus_size (shift ((fun p -> p) Big.one) t)))
  | Sigmoid -> bumpF (exp_of_minus_size t)
  | Softplus -> sigmoidF t
  | Elu -> if is_positive t then oneF else exp_of_minus_size t
  | Selu ->
    if is_positive t
    then selu_scaleF
    else mulF (mulF selu_scaleF selu_alphaF) (exp_of_minus_size t)
  | Silu ->
    addF (sigmoidF t) (mulF (of_dyadic t) (bumpF (exp_of_minus_size t)))
  | Gelu -> gelu_slopeF t
  | _ -> (Big.zero, Big.zero)

(** val nearest : (dyadic * dyadic) -> dyadic **)

let nearest i =
  if (&&) (is_below_zero (fst i)) (is_positive (snd i))
  then zero
  else smaller (abs (fst i)) (abs (snd i))

(** val farthest : (dyadic * dyadic) -> dyadic **)

let farthest i =
  larger (abs (fst i)) (abs (snd i))

(** val steepest_place : activation -> dyadic * dyadic **)

let steepest_place = function
| Gelu ->
  ((((fun p -> p) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    Big.one))))))))), (Big.neg ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    Big.one))))), (((fun p -> p) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    Big.one))))))))))))), (Big.neg ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    Big.one))))))
| _ ->
  ((((fun p -> p) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) Big.one))))))))))))), (Big.neg
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    Big.one))))), (((fun p -> p) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) Big.one))))))))))))), (Big.neg
    ((fun p -> Big.succ (Big.shift_left p 1))
    ((fun p -> Big.succ (Big.shift_left p 1)) ((fun p -> Big.shift_left p 1)
    Big.one))))))

(** val derivatives : activation -> (dyadic * dyadic) -> dyadic * dyadic **)

let derivatives a i =
  let negative = is_below_zero (fst i) in
  let positive0 = is_positive (snd i) in
  (match a with
   | Relu ->
     ((if (||) negative (negb positive0) then zero else one),
       (if positive0 then one else zero))
   | Tanh ->
     (((fst (slope_at a (farthest i))), (Big.neg
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       Big.one)))))))))), ((snd (slope_at a (nearest i))), (Big.neg
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       Big.one)))))))))))
   | Sigmoid ->
     (((fst (slope_at a (farthest i))), (Big.neg
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       Big.one)))))))))), ((snd (slope_at a (nearest i))), (Big.neg
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       Big.one)))))))))))
   | Selu ->
     if negative
     then let least0 = ((fst (slope_at Selu (fst i))), (Big.neg
            ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
            ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
            ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
            ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
            Big.one))))))))))
          in
          ((if positive0
            then smaller least0 ((fst selu_scaleF), (Big.neg
                   ((fun p -> Big.shift_left p 1)
                   ((fun p -> Big.shift_left p 1)
                   ((fun p -> Big.shift_left p 1)
                   ((fun p -> Big.shift_left p 1)
                   ((fun p -> Big.shift_left p 1)
                   ((fun p -> Big.shift_left p 1)
                   ((fun p -> Big.shift_left p 1)
                   ((fun p -> Big.shift_left p 1) Big.one))))))))))
            else least0),
          ((snd (slope_at Selu (if positive0 then zero else snd i))),
          (Big.neg ((fun p -> Big.shift_left p 1)
          ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
          ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
          ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
          ((fun p -> Big.shift_left p 1) Big.one)))))))))))
     else (((fst selu_scaleF), (Big.neg ((fun p -> Big.shift_left p 1)
            ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
            ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
            ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
            ((fun p -> Big.shift_left p 1) Big.one)))))))))),
            ((snd selu_scaleF), (Big.neg ((fun p -> Big.shift_left p 1)
            ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
            ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
            ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
            ((fun p -> Big.shift_left p 1) Big.one)))))))))))
   | Silu ->
     let s = slope_at a (fst i) in
     let t = slope_at a (snd i) in
     let (p, q) = steepest_place a in
     ((if (||) (below (neg p) (fst i)) (below (snd i) (neg q))
       then smaller ((fst s), (Big.neg ((fun p -> Big.shift_left p 1)
              ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
              ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
              ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
              ((fun p -> Big.shift_left p 1) Big.one)))))))))) ((fst t),
              (Big.neg ((fun p -> Big.shift_left p 1)
              ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
              ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
              ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
              ((fun p -> Big.shift_left p 1) Big.one))))))))))
       else fst (range_of a)),
     (if (||) (below q (fst i)) (below (snd i) p)
      then larger ((snd s), (Big.neg ((fun p -> Big.shift_left p 1)
             ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
             ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
             ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
             ((fun p -> Big.shift_left p 1) Big.one)))))))))) ((snd t),
             (Big.neg ((fun p -> Big.shift_left p 1)
             ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
             ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
             ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
             ((fun p -> Big.shift_left p 1) Big.one))))))))))
      else steepest a))
   | Gelu ->
     let s = slope_at a (fst i) in
     let t = slope_at a (snd i) in
     let (p, q) = steepest_place a in
     ((if (||) (below (neg p) (fst i)) (below (snd i) (neg q))
       then smaller ((fst s), (Big.neg ((fun p -> Big.shift_left p 1)
              ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
              ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
              ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
              ((fun p -> Big.shift_left p 1) Big.one)))))))))) ((fst t),
              (Big.neg ((fun p -> Big.shift_left p 1)
              ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
              ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
              ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
              ((fun p -> Big.shift_left p 1) Big.one))))))))))
       else fst (range_of a)),
     (if (||) (below q (fst i)) (below (snd i) p)
      then larger ((snd s), (Big.neg ((fun p -> Big.shift_left p 1)
             ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
             ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
             ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
             ((fun p -> Big.shift_left p 1) Big.one)))))))))) ((snd t),
             (Big.neg ((fun p -> Big.shift_left p 1)
             ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
             ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
             ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
             ((fun p -> Big.shift_left p 1) Big.one))))))))))
      else steepest a))
   | _ ->
     (((fst (slope_at a (fst i))), (Big.neg ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) Big.one)))))))))),
       ((snd (slope_at a (snd i))), (Big.neg ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) Big.one))))))))))))

(** val slopes_between :
    activation -> (dyadic * dyadic) -> dyadic * dyadic **)

let slopes_between a i =
  let (l, h) = derivatives a i in
  ((larger
     (add0
       (ceil_to (Big.neg ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
         ((fun p -> Big.succ (Big.shift_left p 1)) Big.one))))) l) ((Big.neg
       Big.one), (Big.neg ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
       ((fun p -> Big.succ (Big.shift_left p 1)) Big.one)))))))
     (if is_rising a then zero else add0 one (neg (steepest a)))),
  (smaller
    (add0
      (floor_to (Big.neg ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.succ (Big.shift_left p 1)) Big.one))))) h)
      (((fun p -> p) Big.one), (Big.neg ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.succ (Big.shift_left p 1)) Big.one))))))) (steepest a)))

(** val half : dyadic -> dyadic **)

let half x =
  shift (Big.neg Big.one) x

(** val fits_layer : layerD -> bool **)

let fits_layer l =
  (=) (length (snd l)) (length (fst l))

(** val grid : dyadic **)

let grid =
  (((fun p -> p) Big.one), (Big.neg ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
    ((fun p -> Big.shift_left p 1) Big.one))))))))

type linear = { slope : dyadic list; middle : dyadic; error : dyadic }

type known = (dyadic * dyadic) * linear

(** val inputs_known : int -> box -> known list **)

let rec inputs_known k = function
| [] -> []
| i :: b' ->
  (i, { slope = (app (repeat zero k) (one :: [])); middle =
    (half (add0 (fst i) (snd i))); error =
    zero }) :: (inputs_known (Stdlib.Int.succ k) b')

(** val radius_of : box -> dyadic list **)

let radius_of b =
  map (fun i -> half (add0 (snd i) (neg (fst i)))) b

(** val rounding_of : dyadic list -> dyadic **)

let rounding_of radius =
  mul0 grid (add0 one (total radius))

(** val row_form : dyadic list -> known list -> linear **)

let rec row_form row s =
  match row with
  | [] -> { slope = []; middle = zero; error = zero }
  | w :: row' ->
    (match s with
     | [] -> { slope = []; middle = zero; error = zero }
     | n :: s' ->
       let f = row_form row' s' in
       { slope = (plus add0 (scale mul0 w (snd n).slope) f.slope); middle =
       (add0 (mul0 w (snd n).middle) f.middle); error =
       (add0 (mul0 (abs w) (snd n).error) f.error) })

(** val rounded : dyadic -> linear -> linear **)

let rounded rounding f =
  { slope =
    (map
      (floor_to (Big.neg ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.shift_left p 1) Big.one)))))))) f.slope); middle =
    (floor_to (Big.neg ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) Big.one))))))) f.middle); error =
    (ceil_to (Big.neg ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) Big.one))))))) (add0 f.error rounding)) }

(** val met : dyadic list -> (dyadic * dyadic) -> linear -> known **)

let met radius i f =
  let spread0 = add0 f.error (dot zero add0 mul0 (map abs f.slope) radius) in
  (((larger (fst i) (add0 f.middle (neg spread0))),
  (smaller (snd i) (add0 f.middle spread0))), f)

(** val passed :
    dyadic list -> dyadic -> matrixD -> dyadic list -> known list -> known
    list **)

let rec passed radius rounding w c s =
  match w with
  | [] -> []
  | row :: w' ->
    (match c with
     | [] -> []
     | a :: c' ->
       let (l, h) = row_ends row (map fst s) in
       let f = row_form row s in
       (met radius ((add0 l a), (add0 h a))
         (rounded rounding { slope = f.slope; middle = (add0 f.middle a);
           error = f.error })) :: (passed radius rounding w' c' s))

(** val ends_of : activation -> (dyadic * dyadic) -> dyadic * dyadic **)

let ends_of a i =
  match a with
  | Relu -> relu_ends i
  | _ -> values_between a i

(** val activated_form : activation -> dyadic -> known -> known **)

let activated_form a rounding = function
| (i, f) ->
  let p = larger (fst i) (smaller f.middle (snd i)) in
  let (l, h) = slopes_between a i in
  let v = ends_of a (p, p) in
  let mean = half (add0 l h) in
  let reach = larger (add0 (snd i) (neg p)) (add0 p (neg (fst i))) in
  ((ends_of a i),
  (rounded rounding { slope = (scale mul0 mean f.slope); middle =
    (add0 (fst v) (mul0 mean (add0 f.middle (neg p)))); error =
    (add0 (mul0 (abs mean) f.error)
      (add0 (mul0 (half (add0 h (neg l))) reach) (add0 (snd v) (neg (fst v))))) }))

(** val constant_form : (dyadic * dyadic) -> known **)

let constant_form i =
  (i, { slope = []; middle =
    (floor_to (Big.neg ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
      ((fun p -> Big.shift_left p 1) Big.one)))))))
      (half (add0 (fst i) (snd i)))); error =
    (add0
      (ceil_to (Big.neg ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.shift_left p 1) ((fun p -> Big.shift_left p 1)
        ((fun p -> Big.shift_left p 1) Big.one)))))))
        (half (add0 (snd i) (neg (fst i))))) grid) })

(** val activated_known : activation -> dyadic -> known list -> known list **)

let rec activated_known a rounding s =
  match a with
  | Sorted k ->
    map constant_form (sorted_by least_ends greatest_ends k (map fst s))
  | Keeping (n, b) ->
    app (activated_known b rounding (firstn n s)) (skipn n s)
  | _ -> map (activated_form a rounding) s

(** val contains_known : box -> known list -> bool **)

let rec contains_known a s =
  match a with
  | [] -> (match s with
           | [] -> true
           | _ :: _ -> false)
  | p :: a' ->
    let (l, h) = p in
    (match s with
     | [] -> false
     | k0 :: s' ->
       let (p0, _) = k0 in
       let (m, k) = p0 in
       (&&) ((&&) (at_most l m) (at_most k h)) (contains_known a' s'))

(** val check_centred :
    dyadic list -> dyadic -> activation list -> layerD list -> layerD ->
    known list -> box list -> box -> bool **)

let rec check_centred radius rounding between0 hidden0 last0 s bounds0 v =
  match hidden0 with
  | [] ->
    (match bounds0 with
     | [] ->
       (&&) (fits_layer last0)
         (contains_known v (passed radius rounding (fst last0) (snd last0) s))
     | _ :: _ -> false)
  | l :: hidden' ->
    (match bounds0 with
     | [] -> false
     | b :: bounds' ->
       let t = passed radius rounding (fst l) (snd l) s in
       (&&) ((&&) (fits_layer l) (contains_known b t))
         (check_centred radius rounding (tl between0) hidden' last0
           (activated_known (hd Relu between0) rounding t) bounds' v))

(** val check_layers_centred :
    activation list -> layerD list -> layerD -> box -> box list -> box -> bool **)

let check_layers_centred between0 hidden0 last0 b bounds0 v =
  let radius = radius_of b in
  check_centred radius (rounding_of radius) between0 hidden0 last0
    (inputs_known 0 b) bounds0 v

type hints = { slope_between : (dyadic -> dyadic -> dyadic);
               rounded_up : (dyadic -> dyadic);
               factor_number : (int -> matrixD -> factor option) }

(** val up : hints -> dyadic -> dyadic **)

let up o x =
  let r = o.rounded_up x in if at_most x r then r else x

type line =
| On
| Off
| Open of dyadic * dyadic * dyadic * dyadic

(** val line_of : hints -> dyadic -> dyadic -> line **)

let line_of o low high =
  if is_nonnegative low
  then On
  else if is_nonnegative (neg high)
       then Off
       else let s = o.slope_between low high in
            Open (low, high, s,
            (larger (add0 high (neg (mul0 s high))) (neg (mul0 s low))))

(** val through_relu :
    dyadic list -> line list -> bool list -> dyadic list * dyadic **)

let rec through_relu c lines below0 =
  match c with
  | [] -> ([], zero)
  | a :: c' ->
    (match lines with
     | [] -> ([], zero)
     | l :: lines' ->
       let (d, k) = through_relu c' lines' (tl below0) in
       (match l with
        | On -> ((a :: d), k)
        | Off -> ((zero :: d), k)
        | Open (low, high, s, t) ->
          if is_nonnegative a
          then (((mul0 a s) :: d), (add0 (mul0 a t) k))
          else if hd (is_positive (add0 low high)) below0
               then ((a :: d), k)
               else ((zero :: d), k)))

(** val combined : dyadic list -> matrixD -> dyadic list **)

let rec combined z0 m =
  match z0 with
  | [] -> []
  | a :: z' ->
    (match m with
     | [] -> []
     | r :: m' ->
       if Big.equal (fst a) Big.zero
       then combined z' m'
       else plus add0 (scale mul0 a r) (combined z' m'))

(** val form_above :
    (layerD * line list) list -> bool list list -> dyadic list -> dyadic ->
    dyadic list * dyadic **)

let rec form_above before below0 c k =
  match before with
  | [] -> (c, k)
  | p :: before' ->
    let (l, lines) = p in
    let (w, bias) = l in
    let (d, j) = through_relu c lines (hd [] below0) in
    form_above before' (tl below0) (combined d w)
      (add0 (add0 k j) (dot zero add0 mul0 d bias))

(** val most0 :
    (layerD * line list) list -> bool list list -> dyadic list -> dyadic ->
    box -> dyadic **)

let most0 before below0 c k b =
  let (d, j) = form_above before below0 c k in add0 j (snd (row_ends d b))

type decision = { neuron : int; is_on : bool; lower_slopes : bool list list }

(** val new_line :
    hints -> box -> (layerD * line list) list -> dyadic list -> dyadic ->
    line list -> line **)

let new_line o b before row bias around =
  let low = neg (up o (most0 before [] (map neg row) (neg bias) b)) in
  let high = up o (most0 before [] row bias b) in
  (match around with
   | [] -> line_of o low high
   | known0 :: _ ->
     (match known0 with
      | Open (l, h, _, _) ->
        line_of o (larger l low) (if at_most h high then h else high)
      | _ -> known0))

(** val new_lines :
    hints -> box -> (layerD * line list) list -> matrixD -> dyadic list ->
    line list -> line list **)

let rec new_lines o b before w c around =
  match w with
  | [] -> []
  | row :: w' ->
    (match c with
     | [] -> []
     | a :: c' ->
       (new_line o b before row a around) :: (new_lines o b before w' c'
                                               (tl around)))

(** val decide :
    box -> (layerD * line list) list -> matrixD -> dyadic list -> line list
    -> decision -> line list option **)

let decide b before w c lines d =
  match nth_error lines d.neuron with
  | Some l ->
    (match l with
     | Open (_, _, _, _) ->
       let row = nth d.neuron w [] in
       let bias = nth d.neuron c zero in
       let end_ =
         if d.is_on
         then most0 before d.lower_slopes (map neg row) (neg bias) b
         else most0 before d.lower_slopes row bias b
       in
       if is_nonnegative (neg end_)
       then Some
              (app (firstn d.neuron lines)
                ((if d.is_on then On else Off) :: (skipn (Stdlib.Int.succ
                                                    d.neuron) lines)))
       else None
     | _ -> Some lines)
  | None -> None

(** val decide_all :
    box -> (layerD * line list) list -> matrixD -> dyadic list -> line list
    -> decision list -> line list option **)

let rec decide_all b before w c lines = function
| [] -> Some lines
| d :: ds' ->
  (match decide b before w c lines d with
   | Some l -> decide_all b before w c l ds'
   | None -> None)

(** val bounds :
    hints -> box -> (layerD * line list) list -> layerD list -> line list
    list -> decision list list -> line list list option **)

let rec bounds o b before ls around ds =
  match ls with
  | [] -> Some []
  | l :: ls' ->
    let (w, c) = l in
    (match decide_all b before w c (new_lines o b before w c (hd [] around))
             (hd [] ds) with
     | Some l0 ->
       (match bounds o b (((w, c), l0) :: before) ls' (tl around) (tl ds) with
        | Some r -> Some (l0 :: r)
        | None -> None)
     | None -> None)

type pair_of_forms = dyadic list * dyadic list

(** val scale_short : dyadic -> dyadic list -> dyadic list **)

let scale_short a u =
  if Big.equal (fst a) Big.zero then [] else scale mul0 a u

(** val outer_sum_of : dyadic list -> dyadic list -> matrixD **)

let rec outer_sum_of p q =
  match p with
  | [] -> []
  | a :: p' ->
    (match q with
     | [] -> []
     | b :: q' ->
       ((mul0 (((fun p -> p) Big.one), ((fun p -> p) Big.one)) (mul0 a b)) :: 
         (plus add0 (scale_short a q') (scale_short b p'))) :: (outer_sum_of
                                                                 p' q'))

(** val quadratic : pair_of_forms list -> matrixD **)

let quadratic ps =
  fold_right (fun p s -> sum add0 (outer_sum_of (fst p) (snd p)) s) [] ps

(** val half0 : dyadic -> dyadic **)

let half0 x =
  shift (Big.neg Big.one) x

(** val unit_form : int -> dyadic list **)

let unit_form n =
  app (repeat zero n) (one :: [])

(** val minus_squares : matrixD -> pair_of_forms list **)

let minus_squares ys =
  map (fun y -> ((map neg y), (map half0 y))) ys

(** val half_last : dyadic list -> dyadic list **)

let rec half_last = function
| [] -> []
| a :: u' ->
  (match u' with
   | [] -> (half0 a) :: []
   | _ :: _ -> a :: (half_last u'))

(** val form_pairs :
    dyadic -> matrixD -> matrixD -> matrixD -> pair_of_forms list **)

let rec form_pairs s q ys all =
  match q with
  | [] -> []
  | r :: q' ->
    (match ys with
     | [] -> []
     | y :: ys' ->
       ((scale mul0 s y),
         (combined (half_last r) all)) :: (form_pairs s q' ys' all))

(** val is_open : line -> bool **)

let is_open = function
| Open (_, _, _, _) -> true
| _ -> false

(** val relu_step :
    line list -> dyadic list -> matrixD -> int -> (pair_of_forms
    list * matrixD) * int **)

let rec relu_step lines ts ys n =
  match lines with
  | [] -> (([], []), n)
  | l :: lines' ->
    (match ys with
     | [] -> (([], []), n)
     | y :: ys' ->
       let (p0, m) =
         relu_step lines' (tl ts) ys'
           (if is_open l then Stdlib.Int.succ n else n)
       in
       let (p, z0) = p0 in
       (match l with
        | On -> ((p, (y :: z0)), m)
        | Off -> ((p, ([] :: z0)), m)
        | Open (_, _, _, _) ->
          let e = unit_form n in
          (((((scale mul0 (neg (hd zero ts)) e),
          (plus add0 y (scale mul0 ((Big.neg Big.one), Big.zero) e))) :: p),
          (e :: z0)), m)))

(** val times_rows : matrixD -> matrixD -> matrixD **)

let times_rows w rows0 =
  map (fun r -> combined r rows0) w

(** val chain_pairs :
    layerD list -> line list list -> dyadic list list -> matrixD -> int ->
    (pair_of_forms list * matrixD) * (matrixD * matrixD) list **)

let rec chain_pairs ls lines ts rows0 n =
  match ls with
  | [] -> (([], rows0), [])
  | l0 :: ls' ->
    let (w, _) = l0 in
    (match lines with
     | [] -> (([], rows0), [])
     | l :: lines' ->
       let y = times_rows w rows0 in
       let (p0, m) = relu_step l (hd [] ts) y n in
       let (p, z0) = p0 in
       let (p1, all) = chain_pairs ls' lines' (tl ts) z0 m in
       let (q, last0) = p1 in (((app p q), last0), ((y, z0) :: all)))

type place = { in_layer : int; in_row : int; stays_on : bool }

type conflict = { first : place; second : place; weight : dyadic;
                  rest : dyadic; times_product : dyadic }

(** val lines_before :
    layerD list -> line list list -> (layerD * line list) list -> int ->
    (layerD * line list) list **)

let rec lines_before ls lines before k =
  (fun fO fS n -> if n=0 then fO () else fS (n-1))
    (fun _ -> before)
    (fun k' ->
    match ls with
    | [] -> before
    | l :: ls' ->
      (match lines with
       | [] -> before
       | a :: lines' -> lines_before ls' lines' ((l, a) :: before) k'))
    k

(** val place_is_open : line list list -> place -> bool **)

let place_is_open lines p =
  match nth_error (nth p.in_layer lines []) p.in_row with
  | Some l -> is_open l
  | None -> false

(** val no_layer : layerD **)

let no_layer =
  ([], [])

(** val form_of_place :
    layerD list -> line list list -> place -> dyadic list * dyadic **)

let form_of_place ls lines p =
  let (w, c) = nth p.in_layer ls no_layer in
  let s = if p.stays_on then one else ((Big.neg Big.one), Big.zero) in
  form_above (lines_before ls lines [] p.in_layer) []
    (scale mul0 s (nth p.in_row w [])) (mul0 s (nth p.in_row c zero))

(** val is_shown :
    layerD list -> line list list -> box -> conflict -> bool **)

let is_shown ls lines b c =
  let (f, k) = form_of_place ls lines c.first in
  let (g, j) = form_of_place ls lines c.second in
  (&&)
    ((&&)
      ((&&)
        ((&&)
          ((&&) (place_is_open lines c.first) (place_is_open lines c.second))
          (is_nonnegative c.weight)) (is_nonnegative c.rest))
      (is_positive (add0 c.weight c.rest)))
    (is_nonnegative
      (neg
        (add0 (add0 (mul0 c.weight k) (mul0 c.rest j))
          (snd
            (row_ends
              (plus add0 (scale mul0 c.weight f) (scale mul0 c.rest g)) b)))))

(** val increment_form : (matrixD * matrixD) list -> place -> dyadic list **)

let increment_form all p =
  let (y, z0) = nth p.in_layer all ([], []) in
  let z_row = nth p.in_row z0 [] in
  if p.stays_on
  then z_row
  else plus add0 (nth p.in_row y [])
         (scale mul0 ((Big.neg Big.one), Big.zero) z_row)

(** val conflict_pairs :
    (matrixD * matrixD) list -> conflict list -> pair_of_forms list **)

let conflict_pairs all cs =
  map (fun c ->
    ((scale mul0 (neg c.times_product) (increment_form all c.first)),
    (increment_form all c.second))) cs

(** val shown_by :
    (int -> matrixD -> factor option) -> int -> int -> matrixD -> bool **)

let rec shown_by factor_of tries k p =
  (fun fO fS n -> if n=0 then fO () else fS (n-1))
    (fun _ -> false)
    (fun tries' ->
    match factor_of k p with
    | Some f ->
      if shows_nonnegative p f
      then true
      else shown_by factor_of tries' (Stdlib.Int.succ k) p
    | None -> false)
    tries

(** val most_factors : int **)

let most_factors =
  Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ (Stdlib.Int.succ
    0)))))))))))))))))))

(** val input_pairs : dyadic -> int -> pair_of_forms list **)

let input_pairs rho n =
  map (fun k -> ((unit_form k), (scale mul0 (half0 rho) (unit_form k))))
    (seq 0 n)

(** val output_pairs : matrixD option -> matrixD -> pair_of_forms list **)

let output_pairs form out =
  match form with
  | Some q -> form_pairs ((Big.neg Big.one), Big.zero) q out out
  | None -> minus_squares out

(** val part_inequality :
    layerD list -> layerD -> matrixD option -> bool list -> dyadic list ->
    dyadic -> line list list -> conflict list -> dyadic list -> matrixD **)

let part_inequality ls last0 form moves scale0 rho lines cs ts =
  let (p0, all) =
    chain_pairs ls lines (split ts (map fst ls)) (selector moves scale0)
      (count moves)
  in
  let (p, z0) = p0 in
  let out = times_rows (fst last0) z0 in
  quadratic
    (app (input_pairs rho (count moves))
      (app p (app (conflict_pairs all cs) (output_pairs form out))))

(** val anything : layerD -> line list **)

let anything l =
  repeat (Open (zero, zero, zero, zero)) (length (fst l))

(** val form_inequality : part -> matrixD -> dyadic list -> matrixD **)

let form_inequality p q ts =
  let n = inputs_of p in
  let rows0 = map unit_form (seq 0 n) in
  let (p0, _) =
    chain_pairs p.hidden (map anything p.hidden)
      (split ts (map fst p.hidden)) rows0 n
  in
  let (s, z0) = p0 in
  quadratic
    (app (form_pairs one q rows0 rows0)
      (app s (minus_squares (times_rows (fst p.outer) z0))))

type proved_form = { lower_rows : matrixD; form_multipliers : dyadic list;
                     form_factor : (int -> matrixD -> factor option) }

(** val check_form : part -> proved_form -> bool **)

let check_form p f =
  (&&) (forallb is_nonnegative f.form_multipliers)
    (shown_by f.form_factor most_factors 0
      (form_inequality p f.lower_rows f.form_multipliers))

type tree =
| Leaf of decision list list * conflict list * dyadic list
| Halve of decision list list * int * dyadic * tree * tree

(** val cut : int -> dyadic -> bool -> box -> box **)

let rec cut k m is_upper b =
  (fun fO fS n -> if n=0 then fO () else fS (n-1))
    (fun _ ->
    match b with
    | [] -> []
    | p :: b' -> let (l, h) = p in (if is_upper then (m, h) else (l, m)) :: b')
    (fun k' ->
    match b with
    | [] -> []
    | i :: b' -> i :: (cut k' m is_upper b'))
    k

(** val check_tree :
    hints -> layerD list -> (line list list -> conflict list -> dyadic list
    -> matrixD) -> box -> line list list -> tree -> bool **)

let rec check_tree o ls inequality b around = function
| Leaf (ds, cs, ts) ->
  (match bounds o b [] ls around ds with
   | Some lines ->
     (&&) (forallb is_nonnegative ts)
       (shown_by o.factor_number most_factors 0
         (inequality lines (filter (is_shown ls lines b) cs) ts))
   | None -> false)
| Halve (ds, k, m, lower, upper) ->
  (match bounds o b [] ls around ds with
   | Some lines ->
     (&&) (check_tree o ls inequality (cut k m false b) lines lower)
       (check_tree o ls inequality (cut k m true b) lines upper)
   | None -> false)

(** val widened0 : matrixD -> dyadic list -> matrixD **)

let rec widened0 w c =
  match w with
  | [] -> []
  | r :: w' ->
    (match c with
     | [] -> []
     | a :: c' -> (app r (a :: [])) :: (widened0 w' c'))

(** val homogeneous : int -> layerD list -> layerD list **)

let rec homogeneous n = function
| [] -> []
| l :: ls' ->
  let (w, c) = l in
  let wide =
    app (widened0 w c)
      (match ls' with
       | [] -> []
       | _ :: _ -> (unit_form n) :: [])
  in
  (wide, (map (fun _ -> zero) wide)) :: (homogeneous (length w) ls')

(** val is_chain : int -> layerD list -> bool **)

let rec is_chain n = function
| [] -> true
| l :: ls' ->
  let (w, _) = l in
  (&&) (forallb (fun r -> (=) (length r) n) w) (is_chain (length w) ls')

(** val face : dyadic list -> int -> dyadic -> box **)

let face radius k s =
  let n = length radius in
  map (fun j ->
    if (=) j k
    then (s, s)
    else if (=) j n
         then (zero, one)
         else ((neg (nth j radius zero)), (nth j radius zero)))
    (seq 0 (Stdlib.Int.succ n))

(** val all_faces : dyadic list -> box list **)

let all_faces radius =
  let n = length radius in
  (face radius n one) :: (flat_map (fun k ->
                           (face radius k (neg (nth k radius zero))) :: (
                           (face radius k (nth k radius zero)) :: []))
                           (seq 0 n))

(** val check_trees :
    hints -> layerD list -> (line list list -> conflict list -> dyadic list
    -> matrixD) -> box list -> tree list -> bool **)

let rec check_trees o ls inequality bs ts =
  match bs with
  | [] -> (match ts with
           | [] -> true
           | _ :: _ -> false)
  | b :: bs' ->
    (match ts with
     | [] -> false
     | t :: ts' ->
       (&&) (check_tree o ls inequality b [] t)
         (check_trees o ls inequality bs' ts'))

(** val passing : int -> int -> layerD list -> layerD list **)

let rec passing n m = function
| [] -> []
| l :: ls' ->
  let (w, c) = l in
  ((app (map (fun r -> app r (repeat zero m)) w)
     (map (fun i -> unit_form (add n i)) (seq 0 m))),
  (app c (repeat zero m))) :: (passing (length w) m ls')

(** val joined_layer : layerD -> layerD -> layerD **)

let joined_layer phi0 rho =
  ((product zero add0 mul0 (fst rho) (fst phi0)),
    (plus add0 (apply zero add0 mul0 (fst rho) (snd phi0)) (snd rho)))

(** val first_layer : part -> layerD **)

let first_layer p =
  hd p.outer p.hidden

(** val term_layer : part -> part -> layerD **)

let term_layer phi0 rho =
  joined_layer phi0.outer ((fst (first_layer rho)),
    (map (fun _ -> zero) (fst (first_layer rho))))

(** val with_units : matrixD -> int -> matrixD **)

let rec with_units w n =
  match w with
  | [] -> []
  | r :: w' -> (app r (unit_form n)) :: (with_units w' (Stdlib.Int.succ n))

(** val coupled : part -> part -> dyadic list -> part **)

let coupled phi0 rho least0 =
  let (w, c) = joined_layer phi0.outer (first_layer rho) in
  { hidden =
  (app (passing (inputs_of phi0) (length w) phi0.hidden) (((with_units w 0),
    (plus add0 c least0)) :: (tl rho.hidden))); outer = rho.outer; clamp =
  phi0.clamp; between = [] }

type range_tree =
| Range_leaf of decision list list
| Range_halves of decision list list * int * dyadic * range_tree * range_tree

(** val all_before :
    layerD list -> line list list -> (layerD * line list) list ->
    (layerD * line list) list **)

let rec all_before ls lines before =
  match ls with
  | [] -> before
  | l :: ls' ->
    (match lines with
     | [] -> before
     | a :: lines' -> all_before ls' lines' ((l, a) :: before))

(** val ends_of0 :
    (layerD * line list) list -> matrixD -> dyadic list -> box -> box **)

let rec ends_of0 before w c b =
  match w with
  | [] -> []
  | row :: w' ->
    (match c with
     | [] -> []
     | a :: c' ->
       ((neg (most0 before [] (map neg row) (neg a) b)),
         (most0 before [] row a b)) :: (ends_of0 before w' c' b))

(** val narrowed : box -> box -> box **)

let rec narrowed known0 v =
  match known0 with
  | [] -> v
  | p :: known' ->
    let (l, h) = p in
    (match v with
     | [] -> v
     | p0 :: v' ->
       let (l', h') = p0 in
       ((larger l l'),
       (if at_most h h' then h else h')) :: (narrowed known' v'))

(** val check_range :
    hints -> layerD list -> layerD -> box -> line list list -> box -> box ->
    range_tree -> bool **)

let rec check_range o ls last0 b around known0 v = function
| Range_leaf ds ->
  (match bounds o b [] ls around ds with
   | Some lines ->
     contains v
       (narrowed known0
         (ends_of0 (all_before ls lines []) (fst last0) (snd last0) b))
   | None -> false)
| Range_halves (ds, k, m, lower, upper) ->
  (match bounds o b [] ls around ds with
   | Some lines ->
     let e =
       narrowed known0
         (ends_of0 (all_before ls lines []) (fst last0) (snd last0) b)
     in
     (&&) (check_range o ls last0 (cut k m false b) lines e v lower)
       (check_range o ls last0 (cut k m true b) lines e v upper)
   | None -> false)

(** val ends_of_terms : int -> term list -> box list -> box option **)

let rec ends_of_terms m others vs =
  match others with
  | [] -> (match vs with
           | [] -> Some (repeat (zero, zero) m)
           | _ :: _ -> None)
  | t :: others' ->
    let { phi = _; inputs_in = _; fewest = low; most = high } = t in
    (match vs with
     | [] -> None
     | v :: vs' ->
       (match ends_of_terms m others' vs' with
        | Some s ->
          if (&&) ((&&) ((=) (length v) m) (Big.leq Big.zero low))
               (Big.leq low high)
          then Some (add_ends low high v s)
          else None
        | None -> None))

(** val joins : part -> int -> bool **)

let joins p n =
  (=) (length (hd [] (fst p.outer))) (outputs (map fst p.hidden) n)

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

(** val is_nil : 'a1 list -> bool **)

let is_nil = function
| [] -> true
| _ :: _ -> false

(** val matrix_at : part list -> int -> int -> matrixD **)

let matrix_at ps p layer =
  fst (nth layer (layers (part_at ps p)) ([], []))

(** val check_norm_below : matrixD -> dyadic -> dyadic list -> bool **)

let check_norm_below w l v =
  (&&)
    ((&&) ((&&) ((=) (length v) (length (hd [] w))) (is_nonnegative l))
      (is_positive (squareD v)))
    (at_most (mul0 (mul0 l l) (squareD v))
      (squareD (apply zero add0 mul0 w v)))

(** val fits_part : part -> bool **)

let fits_part p =
  forallb (fun l -> (=) (length (snd l)) (length (fst l))) (layers p)

(** val following : activation list -> 'a1 list -> (activation * 'a1) list **)

let rec following between0 = function
| [] -> []
| l :: hidden' -> ((hd Relu between0), l) :: (following (tl between0) hidden')

(** val units : activation -> 'a1 list -> dyadic list **)

let units a rows0 =
  by_number (fun b _ -> unit_of b) (fun _ -> one) a rows0

(** val scale_columns : dyadic list -> matrixD -> matrixD **)

let scale_columns b m =
  map (times mul0 b) m

(** val scaled_matrices :
    dyadic list -> activation list -> layerD list -> layerD -> stack **)

let rec scaled_matrices b between0 later last0 =
  match later with
  | [] -> ([], (scale_columns b (fst last0)))
  | l :: later' ->
    let rest0 =
      scaled_matrices (units (hd Relu between0) (fst l)) (tl between0) later'
        last0
    in
    (((scale_columns b (fst l)) :: (fst rest0)), (snd rest0))

(** val matrices : part -> stack **)

let matrices p =
  match p.hidden with
  | [] -> ([], (fst p.outer))
  | first0 :: later ->
    let rest0 =
      scaled_matrices (units (hd Relu p.between) (fst first0)) (tl p.between)
        later p.outer
    in
    (((fst first0) :: (fst rest0)), (snd rest0))

(** val divided_ranges : activation -> 'a1 list -> rangeD list **)

let divided_ranges a rows0 =
  map (fun _ -> divided_range (base a)) rows0

(** val whole_ranges : activation -> 'a1 list -> rangeD list **)

let whole_ranges a rows0 =
  by_number (fun b _ -> range_of b) (fun _ -> kept_range) a rows0

(** val relation_by :
    (activation -> matrixD -> rangeD list) -> activation -> matrixD ->
    relationD **)

let relation_by ranges a rows0 =
  match a with
  | Sorted s ->
    (match s with
     | Groups k -> Grouped ((Nat.div (length rows0) k), k)
     | _ -> Each (ranges a rows0))
  | _ -> Each (ranges a rows0)

(** val relations_by :
    (activation -> matrixD -> rangeD list) -> part -> relationD list **)

let relations_by ranges p =
  map (fun l -> relation_by ranges (fst l) (fst (snd l)))
    (following p.between p.hidden)

(** val relu_between : part -> bool **)

let relu_between p =
  forallb is_relu p.between

(** val entrywise_between : part -> bool **)

let entrywise_between p =
  forallb changes_numbers p.between

(** val chained : activation -> 'a1 list -> bool **)

let chained a rows0 =
  match a with
  | Sorted s ->
    (match s with
     | Groups k -> (=) (length rows0) (mul (Nat.div (length rows0) k) k)
     | _ -> changes_numbers a)
  | _ -> changes_numbers a

(** val chained_between : part -> bool **)

let chained_between p =
  forallb (fun l -> chained (fst l) (fst (snd l)))
    (following p.between p.hidden)

(** val interleaved : 'a1 list -> 'a1 list -> 'a1 list **)

let rec interleaved u v =
  match u with
  | [] -> []
  | a :: u' ->
    (match v with
     | [] -> []
     | b :: v' -> a :: (b :: (interleaved u' v')))

(** val by_pairs : 'a1 list -> 'a1 list **)

let by_pairs l =
  let h = Nat.div2 (length l) in interleaved (firstn h l) (skipn h l)

(** val turned : 'a1 list -> 'a1 list **)

let turned row =
  let h = Nat.div2 (length row) in interleaved (skipn h row) (firstn h row)

(** val turned_if : bool -> 'a1 list list -> 'a1 list list **)

let turned_if b m =
  if b then map turned m else m

(** val regrouped_layers :
    bool -> activation list -> layerD list -> layerD -> activation
    list * (layerD list * layerD) **)

let rec regrouped_layers turn between0 hidden0 last0 =
  match hidden0 with
  | [] -> ([], ([], ((turned_if turn (fst last0)), (snd last0))))
  | l :: hidden' ->
    let (m, b) = l in
    let m' = turned_if turn m in
    (match hd Relu between0 with
     | Sorted s ->
       (match s with
        | Groups k ->
          let p = ((Sorted (Groups k)), (m', b)) in
          let is_turned = false in
          let (a, l0) = p in
          let rest0 = regrouped_layers is_turned (tl between0) hidden' last0
          in
          ((a :: (fst rest0)), ((l0 :: (fst (snd rest0))), (snd (snd rest0))))
        | Halves ->
          let p = ((Sorted (Groups (Stdlib.Int.succ (Stdlib.Int.succ 0)))),
            ((by_pairs m'), (by_pairs b)))
          in
          let is_turned = true in
          let (a, l0) = p in
          let rest0 = regrouped_layers is_turned (tl between0) hidden' last0
          in
          ((a :: (fst rest0)), ((l0 :: (fst (snd rest0))), (snd (snd rest0))))
        | Pairs ->
          let p = ((Sorted (Groups (Stdlib.Int.succ (Stdlib.Int.succ 0)))),
            (m', b))
          in
          let is_turned = true in
          let (a, l0) = p in
          let rest0 = regrouped_layers is_turned (tl between0) hidden' last0
          in
          ((a :: (fst rest0)), ((l0 :: (fst (snd rest0))), (snd (snd rest0)))))
     | x ->
       let p = (x, (m', b)) in
       let is_turned = false in
       let (a, l0) = p in
       let rest0 = regrouped_layers is_turned (tl between0) hidden' last0 in
       ((a :: (fst rest0)), ((l0 :: (fst (snd rest0))), (snd (snd rest0)))))

(** val regrouped : part -> part **)

let regrouped p =
  let r = regrouped_layers false p.between p.hidden p.outer in
  { hidden = (fst (snd r)); outer = (snd (snd r)); clamp = p.clamp; between =
  (fst r) }

(** val turns_fit : activation list -> layerD list -> layerD -> bool **)

let rec turns_fit between0 hidden0 last0 =
  match hidden0 with
  | [] -> true
  | l :: hidden' ->
    let (m, _) = l in
    (&&)
      (match hd Relu between0 with
       | Sorted s ->
         (match s with
          | Groups _ -> true
          | _ ->
            (&&) (Nat.even (length m))
              (forallb (fun r -> (=) (length r) (length m))
                (fst (hd last0 hidden'))))
       | _ -> true) (turns_fit (tl between0) hidden' last0)

(** val may_regroup : part -> bool **)

let may_regroup p =
  (&&) (fits_part p) (turns_fit p.between p.hidden p.outer)

(** val parts_of : part list -> function0 -> part list **)

let parts_of ps = function
| Alone p -> (part_at ps p) :: []
| Set_of (phi0, rho) -> (part_at ps phi0) :: ((part_at ps rho) :: [])

(** val well_formed :
    part list -> function0 -> bool list -> dyadic list -> bool **)

let well_formed ps f moves scale0 =
  (&&)
    ((&&)
      ((&&)
        ((&&) (forallb fits_part (parts_of ps f))
          (forallb (fun p -> is_nil p.clamp) (tl (parts_of ps f))))
        ((=) (length moves) (inputs_of (part_at ps (moved f)))))
      (positive_scale scale0))
    ((||) (is_nil scale0) ((=) (length scale0) (length moves)))

(** val check_slope :
    part list -> function0 -> bool list -> dyadic list -> dyadic -> dyadic ->
    dyadic list -> factor -> bool **)

let check_slope ps f moves scale0 u rho t factor0 =
  let qs = map regrouped ps in
  (&&) (forallb may_regroup (parts_of ps f))
    ((&&)
      ((&&)
        ((&&) (well_formed qs f moves scale0)
          (forallb chained_between (parts_of qs f))) (is_nonnegative u))
      (check_parts (flat_map (relations_by divided_ranges) (parts_of qs f))
        ([], (selector moves scale0)) (map matrices (parts_of qs f)) u rho t
        factor0))

(** val find_norm : claim list -> int -> int -> dyadic option **)

let rec find_norm accepted p layer =
  match accepted with
  | [] -> None
  | c :: rest0 ->
    (match c with
     | Norm_at_most (q, k, u) ->
       if (&&) ((=) p q) ((=) layer k)
       then Some u
       else find_norm rest0 p layer
     | _ -> find_norm rest0 p layer)

(** val norms : claim list -> int -> int -> layerD list -> dyadic option **)

let rec norms accepted p layer = function
| [] -> Some one
| _ :: ls' ->
  (match find_norm accepted p layer with
   | Some u ->
     (match norms accepted p (Stdlib.Int.succ layer) ls' with
      | Some v -> if is_nonnegative u then Some (mul0 u v) else None
      | None -> None)
   | None -> None)

(** val with_slopes : activation list -> 'a1 list -> dyadic -> dyadic **)

let with_slopes between0 hidden0 u =
  fold_right (fun l v -> mul0 (steepest (fst l)) v) u
    (following between0 hidden0)

(** val norm_of : part list -> claim list -> int -> dyadic option **)

let norm_of ps accepted p =
  let q = part_at ps p in
  option_map (with_slopes q.between q.hidden) (norms accepted p 0 (layers q))

(** val largest : dyadic -> dyadic list -> dyadic **)

let rec largest m = function
| [] -> m
| s :: scale' -> largest (if at_most m s then s else m) scale'

(** val behind_of : part list -> claim list -> function0 -> dyadic option **)

let behind_of ps accepted = function
| Alone _ -> Some one
| Set_of (_, rho) -> norm_of ps accepted rho

(** val check_product_with :
    part list -> claim list -> function0 -> bool list -> dyadic list ->
    dyadic -> dyadic option -> bool **)

let check_product_with ps accepted f moves scale0 u first0 =
  let m = largest (hd one scale0) scale0 in
  (&&)
    ((&&) ((&&) (well_formed ps f moves scale0) (at_most (hd one scale0) m))
      (forallb (fun s -> at_most s m) scale0))
    (match first0 with
     | Some a ->
       (match behind_of ps accepted f with
        | Some b -> at_most (mul0 m (mul0 a b)) u
        | None -> false)
     | None -> false)

(** val check_product :
    part list -> claim list -> function0 -> bool list -> dyadic list ->
    dyadic -> bool **)

let check_product ps accepted f moves scale0 u =
  check_product_with ps accepted f moves scale0 u
    (norm_of ps accepted (moved f))

(** val steepest_known : activation -> known list -> dyadic **)

let rec steepest_known a s =
  match a with
  | Sorted _ -> one
  | Keeping (n, b) -> larger one (steepest_known b (firstn n s))
  | _ ->
    fold_right (fun n m ->
      let (l, h) = slopes_between a (fst n) in larger (larger h (neg l)) m)
      zero s

(** val steepest_centred :
    dyadic list -> dyadic -> activation list -> layerD list -> known list ->
    dyadic **)

let rec steepest_centred radius rounding between0 hidden0 s =
  match hidden0 with
  | [] -> one
  | l :: hidden' ->
    let t = passed radius rounding (fst l) (snd l) s in
    let a = hd Relu between0 in
    mul0 (steepest_known a t)
      (steepest_centred radius rounding (tl between0) hidden'
        (activated_known a rounding t))

(** val steepest_on_box : part -> box -> dyadic **)

let steepest_on_box p b =
  let c = clamp_ends p.clamp b in
  let radius = radius_of c in
  steepest_centred radius (rounding_of radius) p.between p.hidden
    (inputs_known 0 c)

(** val check_local_product :
    part list -> claim list -> function0 -> bool list -> dyadic list -> box
    -> dyadic -> bool **)

let check_local_product ps accepted f moves scale0 b u =
  let p = part_at ps (moved f) in
  check_product_with ps accepted f moves scale0 u
    (option_map (mul0 (steepest_on_box p b))
      (norms accepted (moved f) 0 (layers p)))

(** val slopes_known : activation -> known list -> rangeD list **)

let slopes_known =
  by_number (fun b n -> slopes_between b (fst n)) (fun _ -> kept_range)

(** val ranges_centred :
    dyadic list -> dyadic -> activation list -> layerD list -> known list ->
    rangeD list list **)

let rec ranges_centred radius rounding between0 hidden0 s =
  match hidden0 with
  | [] -> []
  | l :: hidden' ->
    let t = passed radius rounding (fst l) (snd l) s in
    let a = hd Relu between0 in
    (slopes_known a t) :: (ranges_centred radius rounding (tl between0)
                            hidden' (activated_known a rounding t))

(** val ranges_on_box : part -> box -> rangeD list list **)

let ranges_on_box p b =
  let c = clamp_ends p.clamp b in
  let radius = radius_of c in
  ranges_centred radius (rounding_of radius) p.between p.hidden
    (inputs_known 0 c)

(** val local_relations :
    part list -> function0 -> box -> relationD list list **)

let local_relations ps f b =
  (map (fun x -> Each x) (ranges_on_box (part_at ps (moved f)) b)) :: (
    match f with
    | Alone _ -> []
    | Set_of (_, rho) -> (relations_by whole_ranges (part_at ps rho)) :: [])

(** val undivided_matrices : part -> stack **)

let undivided_matrices p =
  ((map fst p.hidden), (fst p.outer))

(** val check_local_slope :
    part list -> function0 -> bool list -> dyadic list -> box -> dyadic ->
    dyadic -> dyadic list -> factor -> bool **)

let check_local_slope ps f moves scale0 b u rho t factor0 =
  (&&)
    ((&&)
      ((&&) (well_formed ps f moves scale0)
        (forallb entrywise_between (parts_of ps f))) (is_nonnegative u))
    (check_parts (concat (local_relations ps f b)) ([],
      (selector moves scale0)) (map undivided_matrices (parts_of ps f)) u rho
      t factor0)

(** val check_parts_with :
    part list -> function0 -> bool list -> dyadic list -> dyadic -> dyadic ->
    proved_form option -> (matrixD option -> bool) -> bool **)

let check_parts_with ps f moves scale0 u r form covers =
  (&&)
    ((&&)
      ((&&)
        ((&&) (well_formed ps f moves scale0)
          (forallb relu_between (parts_of ps f))) (is_nonnegative u))
      (at_most r (mul0 u u)))
    (match f with
     | Alone _ -> (match form with
                   | Some _ -> false
                   | None -> covers None)
     | Set_of (_, rho) ->
       (match form with
        | Some q ->
          (&&)
            ((&&)
              ((=) (length (fst (part_at ps (moved f)).outer))
                (inputs_of (part_at ps rho))) (check_form (part_at ps rho) q))
            (covers (Some q.lower_rows))
        | None -> false))

(** val check_parts_of_box :
    part list -> function0 -> bool list -> dyadic list -> box -> dyadic ->
    dyadic -> proved_form option -> hints -> tree -> bool **)

let check_parts_of_box ps f moves scale0 b u r form o t =
  let p = part_at ps (moved f) in
  check_parts_with ps f moves scale0 u r form (fun q ->
    check_tree o p.hidden (part_inequality p.hidden p.outer q moves scale0 r)
      (clamp_ends p.clamp b) [] t)

(** val check_parts_of_all :
    part list -> function0 -> bool list -> dyadic list -> dyadic -> dyadic ->
    proved_form option -> hints -> dyadic list -> tree list -> bool **)

let check_parts_of_all ps f moves scale0 u r form o radius ts =
  let p = part_at ps (moved f) in
  let n = inputs_of p in
  let ls = homogeneous n p.hidden in
  (&&)
    ((&&)
      ((&&) ((&&) (negb (is_nil p.hidden)) (is_chain n p.hidden))
        ((=) (length radius) n)) (forallb is_positive radius))
    (check_parts_with ps f moves scale0 u r form (fun q ->
      check_trees o ls
        (part_inequality ls p.outer q (app moves (false :: [])) scale0 r)
        (all_faces radius) ts))

(** val check_term_range :
    part list -> int -> hints -> term -> (box * range_tree) -> bool **)

let check_term_range ps rho o t v =
  let p = part_at ps t.phi in
  (&&)
    ((&&) ((&&) (fits_part p) (relu_between p))
      (joins p (length t.inputs_in)))
    (check_range o p.hidden (term_layer p (part_at ps rho))
      (clamp_ends p.clamp t.inputs_in) [] [] (fst v) (snd v))

(** val check_term_ranges :
    part list -> int -> hints -> term list -> (box * range_tree) list -> bool **)

let rec check_term_ranges ps rho o others vs =
  match others with
  | [] -> (match vs with
           | [] -> true
           | _ :: _ -> false)
  | t :: others' ->
    (match vs with
     | [] -> false
     | v :: vs' ->
       (&&) (check_term_range ps rho o t v)
         (check_term_ranges ps rho o others' vs'))

(** val check_slope_among :
    part list -> int -> int -> bool list -> dyadic list -> box -> term list
    -> dyadic -> dyadic -> hints -> (box * range_tree) list -> tree -> bool **)

let check_slope_among ps p rho moves scale0 b others u r o ranges t =
  let f = part_at ps p in
  let g = part_at ps rho in
  let n = inputs_of f in
  let m = length (fst (first_layer g)) in
  (&&)
    ((&&)
      ((&&)
        ((&&)
          ((&&)
            ((&&)
              ((&&)
                ((&&)
                  ((&&)
                    ((&&)
                      ((&&) ((&&) (fits_part f) (relu_between f))
                        ((<=) (length f.clamp) n)) (joins f n))
                    (negb (is_nil f.hidden))) (is_chain n f.hidden))
                (fits_part g)) (relu_between g)) (is_nil g.clamp))
          (negb (is_nil g.hidden))) ((=) (length moves) n))
      (check_term_ranges ps rho o others ranges))
    (match ends_of_terms m others (map fst ranges) with
     | Some s ->
       check_parts_of_box ((coupled f g (map fst s)) :: []) (Alone 0)
         (app moves (repeat false m))
         (if is_nil scale0 then [] else app scale0 (repeat one m))
         (app b (map (fun i -> (zero, (add0 (snd i) (neg (fst i))))) s)) u r
         None o t
     | None -> false)

(** val value_ends : part -> box -> box **)

let value_ends p b =
  network_ends p.between p.hidden p.outer (clamp_ends p.clamp b)

(** val value_of_ends : part list -> function0 -> box -> box -> box **)

let value_of_ends ps f rest0 x =
  match f with
  | Alone p -> value_ends (part_at ps p) x
  | Set_of (phi0, rho) ->
    value_ends (part_at ps rho)
      (plus_ends (value_ends (part_at ps phi0) x) rest0)

(** val at_point : dyadic list -> box **)

let at_point x =
  map (fun a -> (a, a)) x

(** val least_square : box -> box -> dyadic **)

let rec least_square a b =
  match a with
  | [] -> zero
  | p :: a' ->
    let (l, h) = p in
    (match b with
     | [] -> zero
     | p0 :: b' ->
       let (m, k) = p0 in
       let d = larger zero (larger (add0 l (neg k)) (add0 m (neg h))) in
       add0 (mul0 d d) (least_square a' b'))

(** val agreeD : bool list -> dyadic list -> dyadic list -> bool **)

let rec agreeD moves x y =
  match moves with
  | [] ->
    (match x with
     | [] -> (match y with
              | [] -> true
              | _ :: _ -> false)
     | _ :: _ -> false)
  | m :: moves' ->
    (match x with
     | [] -> false
     | a :: x' ->
       (match y with
        | [] -> false
        | b :: y' ->
          (&&) ((||) m (Big.equal (fst (add0 a (neg b))) Big.zero))
            (agreeD moves' x' y')))

(** val fraction_in : dyadic list -> dyadic list -> dyadic * dyadic **)

let rec fraction_in scale0 = function
| [] -> (zero, one)
| a :: d' ->
  let s = hd one scale0 in
  let (n, m) = fraction_in (tl scale0) d' in
  ((add0 (mul0 n (mul0 s s)) (mul0 (mul0 a a) m)), (mul0 m (mul0 s s)))

(** val check_points :
    part list -> int list list -> function0 -> bool list -> dyadic list ->
    dyadic -> dyadic list -> dyadic list -> (int * dyadic list) list -> bool **)

let check_points ps silent f moves scale0 l x y others =
  let rest0 =
    fold_right plus_ends []
      (map (fun o -> value_ends (part_at ps (fst o)) (at_point (snd o)))
        others)
  in
  let (n, m) = fraction_in scale0 (minusD x y) in
  (&&)
    ((&&)
      ((&&)
        ((&&)
          ((&&)
            ((&&)
              ((&&) (negb (is_silent silent ((moved f) :: (map fst others))))
                (positive_scale scale0)) (is_nonnegative l))
            (agreeD moves x y))
          ((=) (length x) (inputs_of (part_at ps (moved f)))))
        (forallb (fun o ->
          (=) (length (snd o)) (inputs_of (part_at ps (fst o)))) others))
      (is_positive n))
    (at_most (mul0 (mul0 l l) n)
      (mul0
        (least_square (value_of_ends ps f rest0 (at_point x))
          (value_of_ends ps f rest0 (at_point y))) m))

(** val same_moves : bool list -> bool list -> bool **)

let rec same_moves a b =
  match a with
  | [] -> (match b with
           | [] -> true
           | _ :: _ -> false)
  | x :: a' ->
    (match b with
     | [] -> false
     | y :: b' -> (&&) (eqb x y) (same_moves a' b'))

(** val find_slope :
    claim list -> int -> int -> bool list -> dyadic option **)

let rec find_slope accepted phi0 rho moves =
  match accepted with
  | [] -> None
  | c :: rest0 ->
    (match c with
     | Slope_at_most (f, m, scale0, u) ->
       (match f with
        | Alone _ -> find_slope rest0 phi0 rho moves
        | Set_of (q, k) ->
          (match scale0 with
           | [] ->
             let others = find_slope rest0 phi0 rho moves in
             if (&&) ((&&) ((=) phi0 q) ((=) rho k)) (same_moves moves m)
             then (match others with
                   | Some v -> if at_most v u then Some v else Some u
                   | None -> Some u)
             else others
           | _ :: _ -> find_slope rest0 phi0 rho moves))
     | _ -> find_slope rest0 phi0 rho moves)

(** val total_of : claim list -> bool -> kind list -> int -> dyadic option **)

let rec total_of accepted squares0 kinds rho =
  match kinds with
  | [] -> Some zero
  | k :: kinds' ->
    let (p, n) = k in
    let (phi0, moves) = p in
    (match find_slope accepted phi0 rho moves with
     | Some k0 ->
       (match total_of accepted squares0 kinds' rho with
        | Some rest0 ->
          if (&&) (is_nonnegative k0) (Big.leq Big.zero n)
          then Some
                 (add0
                   (mul0 (n, Big.zero) (if squares0 then mul0 k0 k0 else k0))
                   rest0)
          else None
        | None -> None)
     | None -> None)

(** val check_law :
    part list -> claim list -> bool -> kind list -> int -> dyadic -> bool **)

let check_law ps accepted stacked kinds rho u =
  (&&) ((&&) (is_nonnegative u) (fits_part (part_at ps rho)))
    (match total_of accepted stacked kinds rho with
     | Some s -> at_most s (if stacked then mul0 u u else u)
     | None -> false)

(** val less_of : dyadic -> dyadic option -> dyadic option **)

let less_of u = function
| Some w -> if at_most w u then Some w else Some u
| None -> Some u

(** val find_slope_in :
    claim list -> int -> int -> bool list -> box -> dyadic option **)

let rec find_slope_in accepted phi0 rho moves b =
  match accepted with
  | [] -> None
  | c0 :: rest0 ->
    (match c0 with
     | Slope_at_most (f, m, scale0, u) ->
       (match f with
        | Alone _ -> find_slope_in rest0 phi0 rho moves b
        | Set_of (q, k) ->
          (match scale0 with
           | [] ->
             let others = find_slope_in rest0 phi0 rho moves b in
             if (&&) ((&&) ((=) phi0 q) ((=) rho k)) (same_moves moves m)
             then less_of u others
             else others
           | _ :: _ -> find_slope_in rest0 phi0 rho moves b))
     | Slope_in_box (f, m, scale0, c, u) ->
       (match f with
        | Alone _ -> find_slope_in rest0 phi0 rho moves b
        | Set_of (q, k) ->
          (match scale0 with
           | [] ->
             let others = find_slope_in rest0 phi0 rho moves b in
             if (&&)
                  ((&&) ((&&) ((=) phi0 q) ((=) rho k)) (same_moves moves m))
                  (same_box b c)
             then less_of u others
             else others
           | _ :: _ -> find_slope_in rest0 phi0 rho moves b))
     | _ -> find_slope_in rest0 phi0 rho moves b)

(** val total_in :
    claim list -> bool -> (kind * box) list -> int -> dyadic option **)

let rec total_in accepted squares0 kinds rho =
  match kinds with
  | [] -> Some zero
  | p :: kinds' ->
    let (k, b) = p in
    let (p0, n) = k in
    let (phi0, moves) = p0 in
    (match find_slope_in accepted phi0 rho moves b with
     | Some k0 ->
       (match total_in accepted squares0 kinds' rho with
        | Some rest0 ->
          if (&&) (is_nonnegative k0) (Big.leq Big.zero n)
          then Some
                 (add0
                   (mul0 (n, Big.zero) (if squares0 then mul0 k0 k0 else k0))
                   rest0)
          else None
        | None -> None)
     | None -> None)

(** val check_law_in_box :
    part list -> claim list -> bool -> (kind * box) list -> int -> dyadic ->
    bool **)

let check_law_in_box ps accepted stacked kinds rho u =
  (&&) ((&&) (is_nonnegative u) (fits_part (part_at ps rho)))
    (match total_in accepted stacked kinds rho with
     | Some s -> at_most s (if stacked then mul0 u u else u)
     | None -> false)

(** val term_among : Big.t -> ((kind * box) * Big.t) -> term **)

let term_among less k =
  let least0 = Big.sub (snd k) less in
  { phi = (fst (fst (fst (fst k)))); inputs_in = (snd (fst k)); fewest =
  (if Big.leq Big.zero least0 then least0 else Big.zero); most =
  (Big.sub (snd (fst (fst k))) less) }

(** val others_of :
    ((kind * box) * Big.t) list -> ((kind * box) * Big.t) ->
    ((kind * box) * Big.t) list -> term list **)

let others_of before k after =
  app (map (term_among Big.zero) before)
    ((term_among ((fun p -> p) Big.one) k) :: (map (term_among Big.zero)
                                                after))

(** val same_terms_in_boxes : term list -> term list -> bool **)

let rec same_terms_in_boxes a b =
  match a with
  | [] -> (match b with
           | [] -> true
           | _ :: _ -> false)
  | s :: a' ->
    (match b with
     | [] -> false
     | t :: b' ->
       (&&)
         ((&&)
           ((&&) ((&&) ((=) s.phi t.phi) (same_box s.inputs_in t.inputs_in))
             (Big.equal s.fewest t.fewest)) (Big.equal s.most t.most))
         (same_terms_in_boxes a' b'))

(** val may_be_there : term -> bool **)

let may_be_there t =
  negb (Big.equal t.most Big.zero)

(** val find_slope_among :
    claim list -> int -> int -> bool list -> box -> term list -> dyadic option **)

let rec find_slope_among accepted p rho moves b others =
  match accepted with
  | [] -> None
  | c0 :: rest0 ->
    (match c0 with
     | Slope_among (q, k, m, scale0, c, ts, u) ->
       (match scale0 with
        | [] ->
          if (&&)
               ((&&) ((&&) ((&&) ((=) p q) ((=) rho k)) (same_moves moves m))
                 (same_box b c))
               (same_terms_in_boxes (filter may_be_there others) ts)
          then Some u
          else find_slope_among rest0 p rho moves b others
        | _ :: _ -> find_slope_among rest0 p rho moves b others)
     | _ -> find_slope_among rest0 p rho moves b others)

(** val total_among :
    claim list -> bool -> ((kind * box) * Big.t) list ->
    ((kind * box) * Big.t) list -> int -> dyadic option **)

let rec total_among accepted squares0 before kinds rho =
  match kinds with
  | [] -> Some zero
  | k :: kinds' ->
    let (p0, _) = k in
    let (k0, b) = p0 in
    let (p1, n) = k0 in
    let (p, moves) = p1 in
    let any = find_slope_in accepted p rho moves b in
    let bound =
      match find_slope_among accepted p rho moves b
              (others_of before k kinds') with
      | Some u -> less_of u any
      | None -> any
    in
    (match bound with
     | Some u ->
       (match total_among accepted squares0 (app before (k :: [])) kinds' rho with
        | Some rest0 ->
          if (&&) (is_nonnegative u) (Big.leq Big.zero n)
          then Some
                 (add0
                   (mul0 (n, Big.zero) (if squares0 then mul0 u u else u))
                   rest0)
          else None
        | None -> None)
     | None -> None)

(** val check_law_among :
    part list -> claim list -> bool -> ((kind * box) * Big.t) list -> int ->
    dyadic -> bool **)

let check_law_among ps accepted stacked kinds rho u =
  (&&) ((&&) (is_nonnegative u) (fits_part (part_at ps rho)))
    (match total_among accepted stacked [] kinds rho with
     | Some s -> at_most s (if stacked then mul0 u u else u)
     | None -> false)

(** val same_function : function0 -> function0 -> bool **)

let same_function f g =
  match f with
  | Alone p -> (match g with
                | Alone q -> (=) p q
                | Set_of (_, _) -> false)
  | Set_of (p, k) ->
    (match g with
     | Alone _ -> false
     | Set_of (q, l) -> (&&) ((=) p q) ((=) k l))

(** val has_slope_in :
    claim list -> function0 -> bool list -> dyadic list -> box -> dyadic ->
    bool **)

let rec has_slope_in accepted f moves scale0 b u =
  match accepted with
  | [] -> false
  | c0 :: rest0 ->
    (match c0 with
     | Slope_in_box (g, n, s, c, v) ->
       (||)
         ((&&)
           ((&&)
             ((&&) ((&&) (same_function f g) (same_moves moves n))
               (same_numbers scale0 s)) (same_box b c)) (at_most v u))
         (has_slope_in rest0 f moves scale0 b u)
     | _ -> has_slope_in rest0 f moves scale0 b u)

(** val check_halves :
    part list -> claim list -> function0 -> bool list -> dyadic list -> box
    -> dyadic -> int -> dyadic -> bool **)

let check_halves ps accepted f moves scale0 b u k m =
  (&&)
    ((&&) (well_formed ps f moves scale0)
      (has_slope_in accepted f moves scale0 (cut k m false b) u))
    (has_slope_in accepted f moves scale0 (cut k m true b) u)

(** val find_within : claim list -> int -> box -> box option **)

let rec find_within accepted p b =
  match accepted with
  | [] -> None
  | c0 :: rest0 ->
    (match c0 with
     | Within (q, c, v) ->
       if (&&) ((=) p q) (same_box b c) then Some v else find_within rest0 p b
     | _ -> find_within rest0 p b)

(** val find_error :
    bool -> claim list -> int -> box -> dyadic list -> (dyadic list * dyadic)
    option **)

let rec find_error in_order accepted p b r =
  match accepted with
  | [] -> None
  | c0 :: rest0 ->
    (match c0 with
     | Float_error (o, q, c, s, e, u) ->
       if (&&) ((&&) ((&&) (eqb in_order o) ((=) p q)) (same_box b c))
            (same_numbers r s)
       then Some (e, u)
       else find_error in_order rest0 p b r
     | _ -> find_error in_order rest0 p b r)

(** val find_alone : claim list -> int -> int -> dyadic option **)

let rec find_alone accepted p n =
  match accepted with
  | [] -> None
  | c :: rest0 ->
    (match c with
     | Slope_at_most (f, moves, scale0, u) ->
       (match f with
        | Alone q ->
          (match scale0 with
           | [] ->
             if (&&) ((&&) ((=) p q) (forallb (fun m -> m) moves))
                  ((=) (length moves) n)
             then Some u
             else find_alone rest0 p n
           | _ :: _ -> find_alone rest0 p n)
        | Set_of (_, _) -> find_alone rest0 p n)
     | _ -> find_alone rest0 p n)

(** val sum_ends : claim list -> int -> term list -> box option **)

let rec sum_ends accepted n = function
| [] -> Some (repeat (zero, zero) n)
| t :: terms' ->
  let { phi = p; inputs_in = b; fewest = low; most = high } = t in
  (match find_within accepted p b with
   | Some v ->
     (match sum_ends accepted n terms' with
      | Some s ->
        if (&&) ((&&) ((=) (length v) n) (Big.leq Big.zero low))
             (Big.leq low high)
        then Some (add_ends low high v s)
        else None
      | None -> None)
   | None -> None)

(** val check_within : part list -> int -> box -> box list -> box -> bool **)

let check_within ps p b bounds0 v =
  let q = part_at ps p in
  let c = clamp_ends q.clamp b in
  if relu_between q
  then check_layers q.hidden q.outer c bounds0 v
  else check_layers_centred q.between q.hidden q.outer c bounds0 v

(** val number_of : (term -> Big.t) -> int -> term list -> Big.t **)

let number_of number p terms =
  fold_right (fun t n -> if (=) t.phi p then Big.add (number t) n else n)
    Big.zero terms

(** val times_in : int -> int list -> Big.t **)

let times_in p those =
  size0 (filter ((=) p) those)

(** val may_be_silent : int list list -> term list -> bool **)

let may_be_silent silent terms =
  existsb (fun c ->
    forallb (fun p ->
      (&&) (Big.leq (number_of (fun t -> t.fewest) p terms) (times_in p c))
        (Big.leq (times_in p c) (number_of (fun t -> t.most) p terms)))
      (app c (map (fun t -> t.phi) terms))) silent

(** val choices_of : int -> term -> int list list **)

let choices_of n t =
  filter (fun c ->
    (&&) (Big.leq t.fewest (size0 c)) (Big.leq (size0 c) t.most))
    (map (repeat t.phi) (seq 0 (Stdlib.Int.succ n)))

(** val all_choices : int -> term list -> int list list **)

let rec all_choices n = function
| [] -> [] :: []
| t :: terms' ->
  flat_map (fun c -> map (app c) (all_choices n terms')) (choices_of n t)

(** val always_silent : int list list -> term list -> bool **)

let always_silent silent terms =
  let longest = fold_right (fun c n -> Stdlib.max (length c) n) 0 silent in
  if forallb (fun t -> Big.leq t.most (size0 (repeat 0 longest))) terms
  then forallb (is_silent silent) (all_choices longest terms)
  else false

(** val check_sum_within :
    part list -> claim list -> int list list -> term list -> int -> box ->
    box -> bool **)

let check_sum_within ps accepted silent terms rho v sums0 =
  match sum_ends accepted (inputs_of (part_at ps rho)) terms with
  | Some s ->
    (match find_within accepted rho sums0 with
     | Some w ->
       (&&)
         ((&&) (contains sums0 s)
           ((||) (contains v w) (always_silent silent terms)))
         ((||) (negb (may_be_silent silent terms))
           (contains v (repeat (zero, zero) (outputs_of (part_at ps rho)))))
     | None -> false)
  | None -> false

(** val check_jump :
    part list -> claim list -> int -> box -> int -> dyadic -> bool **)

let check_jump ps accepted p b rho u =
  match find_within accepted p b with
  | Some v ->
    (match find_alone accepted rho (inputs_of (part_at ps rho)) with
     | Some k ->
       (&&)
         ((&&)
           ((&&) ((=) (length v) (inputs_of (part_at ps rho)))
             (is_nonnegative k)) (is_nonnegative u))
         (at_most (mul0 (mul0 k k) (squareD (map largest_abs v))) (mul0 u u))
     | None -> false)
  | None -> false

(** val find_jump : claim list -> int -> box -> int -> dyadic option **)

let rec find_jump accepted p b rho =
  match accepted with
  | [] -> None
  | c0 :: rest0 ->
    (match c0 with
     | Jump_at_most (q, c, k, u) ->
       if (&&) ((&&) ((=) p q) ((=) rho k)) (same_box b c)
       then Some u
       else find_jump rest0 p b rho
     | _ -> find_jump rest0 p b rho)

(** val without : int -> int list -> int list **)

let rec without p = function
| [] -> []
| q :: those' -> if (=) p q then those' else q :: (without p those')

(** val beside : int list list -> int -> int list list **)

let beside silent p =
  filter (fun c -> negb (is_silent silent c))
    (flat_map (fun c ->
      (p :: c) :: (if (=) (count_of p c) 0 then [] else (without p c) :: []))
      silent)

(** val terms_of : (int * box) list -> int list -> term list option **)

let rec terms_of boxes = function
| [] -> Some []
| p :: those' ->
  (match box_of boxes p with
   | Some b ->
     (match terms_of boxes those' with
      | Some ts ->
        Some ({ phi = p; inputs_in = b; fewest = ((fun p -> p) Big.one);
          most = ((fun p -> p) Big.one) } :: ts)
      | None -> None)
   | None -> None)

(** val check_value_among :
    part list -> claim list -> (int * box) list -> int -> dyadic -> int list
    -> box -> bool **)

let check_value_among ps accepted boxes rho u those sums0 =
  match terms_of boxes those with
  | Some ts ->
    (match sum_ends accepted (inputs_of (part_at ps rho)) ts with
     | Some s ->
       (match find_within accepted rho sums0 with
        | Some w ->
          (&&) (contains sums0 s)
            (at_most (squareD (map largest_abs w)) (mul0 u u))
        | None -> false)
     | None -> false)
  | None -> false

(** val check_all_among :
    part list -> claim list -> (int * box) list -> int -> dyadic -> int list
    list -> box list -> bool **)

let rec check_all_among ps accepted boxes rho u compositions sums0 =
  match compositions with
  | [] -> (match sums0 with
           | [] -> true
           | _ :: _ -> false)
  | c :: compositions' ->
    (match sums0 with
     | [] -> false
     | s :: sums' ->
       (&&) (check_value_among ps accepted boxes rho u c s)
         (check_all_among ps accepted boxes rho u compositions' sums'))

(** val check_step :
    part list -> claim list -> int list list -> (int * box) list -> int ->
    int -> dyadic -> box list -> bool **)

let check_step ps accepted silent boxes p rho u sums0 =
  (&&)
    ((&&)
      ((&&) (is_nonnegative u)
        (forallb (fun b ->
          (&&) (fits_part (part_at ps (fst b)))
            ((=) (outputs_of (part_at ps (fst b)))
              (inputs_of (part_at ps rho)))) boxes))
      (match box_of boxes p with
       | Some b ->
         (match find_jump accepted p b rho with
          | Some w -> at_most w u
          | None -> false)
       | None -> false))
    (check_all_among ps accepted boxes rho u (beside silent p) sums0)

(** val list_norms :
    claim list -> int -> int -> layerD list -> dyadic list option **)

let rec list_norms accepted p layer = function
| [] -> Some []
| _ :: ls' ->
  (match find_norm accepted p layer with
   | Some u ->
     (match list_norms accepted p (Stdlib.Int.succ layer) ls' with
      | Some us -> if is_nonnegative u then Some (u :: us) else None
      | None -> None)
   | None -> None)

(** val unclamped_slope : part list -> claim list -> int -> dyadic option **)

let unclamped_slope ps accepted p =
  let q = part_at ps p in
  (match if is_nil q.clamp then find_alone accepted p (inputs_of q) else None with
   | Some k -> Some k
   | None -> norm_of ps accepted p)

(** val check_error :
    part list -> claim list -> bool -> int -> box -> dyadic list -> dyadic
    list -> dyadic -> box list -> dyadic list list -> dyadic -> dyadic list
    -> dyadic -> bool **)

let check_error ps accepted in_order p b r e u bounds0 errors moved0 offs made =
  let q = part_at ps p in
  (&&) ((&&) (relu_between q) (fits_part q))
    (match list_norms accepted p 0 (layers q) with
     | Some ns ->
       (match unclamped_slope ps accepted p with
        | Some k ->
          (&&)
            ((&&)
              ((&&)
                ((&&)
                  ((&&)
                    ((&&)
                      (check_roundings in_order q.hidden q.outer
                        (clamp_ends q.clamp b) r bounds0 errors e ns zero
                        offs made) (is_nonnegative u)) (is_nonnegative k))
                  (is_nonnegative moved0))
                (at_most (squareD r) (mul0 moved0 moved0)))
              ((=) (length r) (inputs_of q)))
            ((||) (at_most (squareD e) (mul0 u u))
              (at_most (add0 (mul0 k moved0) made) u))
        | None -> false)
     | None -> false)

(** val sum_errors :
    bool -> claim list -> int -> (term * dyadic list) list ->
    ((Big.t * dyadic list) * dyadic list) option **)

let rec sum_errors in_order accepted n = function
| [] -> Some ((((fun p -> p) Big.one), (repeat zero n)), (repeat zero n))
| p0 :: terms' ->
  let (t, r) = p0 in
  let { phi = p; inputs_in = b; fewest = _; most = high } = t in
  (match find_within accepted p b with
   | Some v ->
     (match find_error in_order accepted p b r with
      | Some p1 ->
        let (e, _) = p1 in
        (match sum_errors in_order accepted n terms' with
         | Some p2 ->
           let (p3, s) = p2 in
           let (count0, m) = p3 in
           if (&&)
                ((&&) ((&&) ((=) (length v) n) ((=) (length e) n))
                  (Big.leq Big.zero high)) (forallb is_nonnegative e)
           then Some (((Big.add high count0),
                  (plus add0 (scale mul0 (high, Big.zero) (sizes v e)) m)),
                  (plus add0 (scale mul0 (high, Big.zero) e) s))
           else None
         | None -> None)
      | None -> None)
   | None -> None)

(** val check_sum_error :
    part list -> claim list -> bool -> (term * dyadic list) list -> int ->
    dyadic -> box -> dyadic list -> bool **)

let check_sum_error ps accepted in_order terms rho u sums0 errors =
  let n = inputs_of (part_at ps rho) in
  (match sum_ends accepted n (map fst terms) with
   | Some s ->
     (match sum_errors in_order accepted n terms with
      | Some p ->
        let (p0, e) = p in
        let (count0, m) = p0 in
        (match find_error in_order accepted rho sums0 errors with
         | Some p1 ->
           let (_, w) = p1 in
           (&&)
             ((&&)
               ((&&)
                 ((&&) (contains sums0 s) (is_nil (part_at ps rho).clamp))
                 ((=) (length errors) n)) (sum_fits count0 m e errors))
             (at_most w u)
         | None -> false)
      | None -> false)
   | None -> false)

(** val check_claim : part list -> claim list -> claim -> proof -> bool **)

let check_claim ps accepted c p =
  match c with
  | Norm_at_most (p0, layer, u) ->
    (match p with
     | By_inequality (rho, t, f) ->
       check [] [] (matrix_at ps p0 layer) u rho t f
     | _ -> false)
  | Norm_at_least (p0, layer, l) ->
    (match p with
     | By_vector v -> check_norm_below (matrix_at ps p0 layer) l v
     | _ -> false)
  | Slope_at_most (f, moves, scale0, u) ->
    (match p with
     | By_inequality (rho, t, r) -> check_slope ps f moves scale0 u rho t r
     | By_product -> check_product ps accepted f moves scale0 u
     | By_all_parts (r, form, o, radius, ts) ->
       check_parts_of_all ps f moves scale0 u r form o radius ts
     | _ -> false)
  | Slope_at_least (silent, f, moves, scale0, l) ->
    (match p with
     | By_points (x, y, others) ->
       check_points ps silent f moves scale0 l x y others
     | _ -> false)
  | Slope_in_box (f, moves, scale0, b, u) ->
    (match p with
     | By_local_product -> check_local_product ps accepted f moves scale0 b u
     | By_local_inequality (rho, t, r) ->
       check_local_slope ps f moves scale0 b u rho t r
     | By_parts (r, form, o, t) ->
       check_parts_of_box ps f moves scale0 b u r form o t
     | By_halves (k, m) -> check_halves ps accepted f moves scale0 b u k m
     | _ -> false)
  | Law (stacked, kinds, rho, u) ->
    (match p with
     | By_triangle -> check_law ps accepted stacked kinds rho u
     | _ -> false)
  | Law_in_box (stacked, kinds, rho, u) ->
    (match p with
     | By_triangle -> check_law_in_box ps accepted stacked kinds rho u
     | _ -> false)
  | Within (p0, b, v) ->
    (match p with
     | By_layers bounds0 -> check_within ps p0 b bounds0 v
     | _ -> false)
  | Sum_within (silent, terms, rho, v) ->
    (match p with
     | By_sum sums0 -> check_sum_within ps accepted silent terms rho v sums0
     | _ -> false)
  | Jump_at_most (p0, b, rho, u) ->
    (match p with
     | By_norm -> check_jump ps accepted p0 b rho u
     | _ -> false)
  | Float_error (in_order, p0, b, r, e, u) ->
    (match p with
     | By_roundings (bounds0, errors, moved0, offs, made) ->
       check_error ps accepted in_order p0 b r e u bounds0 errors moved0 offs
         made
     | _ -> false)
  | Sum_float_error (in_order, terms, rho, u) ->
    (match p with
     | By_rounded_sum (sums0, errors) ->
       check_sum_error ps accepted in_order terms rho u sums0 errors
     | _ -> false)
  | Slope_among (p0, rho, moves, scale0, b, others, u) ->
    (match p with
     | By_parts_among (r, o, ranges, t) ->
       check_slope_among ps p0 rho moves scale0 b others u r o ranges t
     | _ -> false)
  | Law_among (stacked, kinds, rho, u) ->
    (match p with
     | By_triangle -> check_law_among ps accepted stacked kinds rho u
     | _ -> false)
  | Step_at_most (silent, boxes, p0, rho, u) ->
    (match p with
     | By_steps sums0 -> check_step ps accepted silent boxes p0 rho u sums0
     | _ -> false)

(** val step :
    part list -> claim list -> claim -> proof -> claim list option **)

let step ps accepted c p =
  if check_claim ps accepted c p then Some (c :: accepted) else None
