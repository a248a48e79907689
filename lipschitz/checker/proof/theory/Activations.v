(** The functions between the layers of a network, and what it means that their slopes are bounded. *)
From Coq Require Import List Reals Lra Lia.
Import ListNotations.
From Swarmcert Require Import Exponential.
Open Scope R_scope.

(** Sorting acts on the whole layer: in groups of k numbers side by side, or as the larger and the smaller of two, of
    one number in each half of the layer or of neighbours; the larger ones come first. *)
Inductive sorting := Groups (k : nat) | Halves | Pairs.
(** `Keeping n a` is a of the first n numbers of a layer. The others stay as they are: what a skip connection takes past
    a. *)
Inductive activation := Relu | Tanh | Sigmoid | Softplus | Elu | Selu | Silu | Gelu | Sorted (s : sorting)
  | Keeping (n : nat) (a : activation).

(** Of numbers or of intervals: `low` and `high` give the smaller and the larger one of two. *)
Section Sorting.
Context {T : Type} (low high : T -> T -> T).
(** By compare and swap: `a` into a list that is in ascending order. *)
Fixpoint inserted (a : T) (l : list T) : list T :=
  match l with [] => [a] | b :: l' => low a b :: inserted (high a b) l' end.
Definition ascending (l : list T) : list T := fold_right inserted [] l.
(** n groups; a last one may be shorter. *)
Fixpoint sorted_groups (n k : nat) (l : list T) : list T :=
  match n with O => [] | S n' => ascending (firstn k l) ++ sorted_groups n' k (skipn k l) end.
Definition both (f : T -> T -> T) (u v : list T) : list T := map (fun p => f (fst p) (snd p)) (combine u v).
Definition of_halves (f : T -> T -> T) (l : list T) : list T :=
  let h := Nat.div2 (length l) in both f (firstn h l) (skipn h l).
Fixpoint of_pairs (f : T -> T -> T) (l : list T) : list T :=
  match l with a :: b :: l' => f a b :: of_pairs f l' | _ => [] end.
Definition sorted_by (s : sorting) (l : list T) : list T :=
  match s with
  | Groups k => sorted_groups (length l) k l
  | Halves => of_halves high l ++ of_halves low l
  | Pairs => of_pairs high l ++ of_pairs low l
  end.
End Sorting.
Definition sort_layer : sorting -> list R -> list R := sorted_by Rmin Rmax.

Definition relu (x : R) : R := Rmax 0 x.
Definition sigmoid (x : R) : R := / (1 + exp (- x)).
(** ln (1 + e^x). *)
Lemma one_and_exp_positive x : 0 < 1 + exp x. Proof. pose proof (exp_pos x). lra. Qed.
Definition softplus (x : R) : R := proj1_sig (logarithm (1 + exp x) (one_and_exp_positive x)).
(** The negative part of ELU, for scale 1. *)
Definition falling (x : R) : R := Rmin 0 (exp x - 1).
(** The constants of SELU. *)
Definition selu_scale : R := 10507009873554805 / 10 ^ 16.
Definition selu_alpha : R := 16732632423543772 / 10 ^ 16.

(** The error function: 2 / sqrt pi times the sum of x (-x^2)^n / (n! (2 n + 1)). *)
Definition erf_term (n : nat) : R := (-1) ^ n / (INR (fact n) * INR (2 * n + 1)).
Lemma erf_divisor n : 0 < INR (fact n) * INR (2 * n + 1).
Proof. apply Rmult_lt_0_compat; apply lt_0_INR; [apply lt_O_fact|lia]. Qed.
Lemma erf_term_not_zero n : erf_term n <> 0.
Proof.
  unfold erf_term, Rdiv. apply Rmult_integral_contrapositive_currified; [apply pow_nonzero; lra|].
  apply Rinv_neq_0_compat. pose proof (erf_divisor n). lra.
Qed.
Lemma erf_terms_fall : Un_cv (fun n => Rabs (erf_term (S n) / erf_term n)) 0.
Proof.
  intros e He. destruct (archimed_cor1 e He) as (N & HN & HP). exists N. intros n Hn. unfold R_dist.
  assert (erf_term (S n) / erf_term n = - (INR (2 * n + 1) / INR (2 * n + 3) * / INR (S n))) as ->.
  { unfold erf_term. replace (2 * S n + 1)%nat with (2 * n + 3)%nat by lia. rewrite fact_simpl, mult_INR. simpl pow.
    pose proof (pow_nonzero (-1) n ltac:(lra)). pose proof (INR_fact_neq_0 n).
    pose proof (not_0_INR (2 * n + 1) ltac:(lia)). pose proof (not_0_INR (2 * n + 3) ltac:(lia)).
    pose proof (not_0_INR (S n) ltac:(lia)). field. auto. }
  rewrite Rabs_Ropp.
  assert (0 < INR (2 * n + 1)) by (apply lt_0_INR; lia). assert (0 < INR (S n)) by (apply lt_0_INR; lia).
  assert (INR (2 * n + 1) <= INR (2 * n + 3)) by (apply le_INR; lia).
  assert (0 < INR N) by (apply lt_0_INR; lia). assert (INR N <= INR (S n)) by (apply le_INR; lia).
  pose proof (Rinv_le_contravar _ _ H2 H3). pose proof (Rinv_0_lt_compat _ H0).
  assert (0 <= INR (2 * n + 1) / INR (2 * n + 3) <= 1) as [A B].
  { split; [apply Rlt_le, Rdiv_lt_0_compat; lra|]. apply (Rmult_le_reg_r (INR (2 * n + 3))); [lra|].
    unfold Rdiv. rewrite Rmult_assoc, Rinv_l by lra. lra. }
  pose proof (Rmult_le_pos _ _ A (Rlt_le _ _ H5)).
  rewrite Rminus_0_r, Rabs_Rabsolu, (Rabs_pos_eq _ H6). pose proof (Rmult_le_compat_r _ _ _ (Rlt_le _ _ H5) B). lra.
Qed.
Definition erf_series (x : R) : { s : R | Pser erf_term x s } :=
  Alembert_C3 erf_term x erf_term_not_zero erf_terms_fall.
Definition erf (x : R) : R := 2 / sqrt PI * (x * proj1_sig (erf_series (x * x))).

Definition act (a : activation) (x : R) : R :=
  match a with
  | Relu => relu x
  | Tanh => tanh x
  | Sigmoid => sigmoid x
  | Softplus => softplus x
  | Elu => relu x + falling x
  | Selu => selu_scale * relu x + selu_scale * selu_alpha * falling x
  | Silu => x / (1 + exp (- x))
  | Gelu => x / 2 * (1 + erf (x / sqrt 2))
  | Sorted _ | Keeping _ _ => x  (* by number they do nothing; see `activated` *)
  end.

(** Of a whole layer. *)
Fixpoint activated (a : activation) (y : list R) : list R :=
  match a with
  | Sorted s => sort_layer s y
  | Keeping n b => activated b (firstn n y) ++ skipn n y
  | _ => map (act a) y
  end.

(** What changes the numbers of a layer that change at all. *)
Fixpoint base (a : activation) : activation := match a with Keeping _ b => base b | _ => a end.
(** A list with one entry for each number of a layer: f of those that change, g of those that stay. *)
Fixpoint by_number {A B} (f : activation -> A -> B) (g : A -> B) (a : activation) (l : list A) : list B :=
  match a with
  | Keeping n b => by_number f g b (firstn n l) ++ map g (skipn n l)
  | _ => map (f a) l
  end.
Lemma length_by_number {A B} (f : activation -> A -> B) g a l : length (by_number f g a l) = length l.
Proof.
  revert l. induction a as [| | | | | | | |s|n a IH]; intros l; simpl; try apply map_length.
  now rewrite app_length, IH, map_length, <- app_length, firstn_skipn.
Qed.
(** What is the same of both. *)
Lemma by_number_alike {A B} (f : A -> B) a l : by_number (fun _ => f) f a l = map f l.
Proof.
  revert l. induction a as [| | | | | | | |s|n a IH]; intros l; simpl; auto. now rewrite IH, <- map_app, firstn_skipn.
Qed.

(** Every slope of f lies in [a, b]. *)
Definition slopes (f : R -> R) (a b : R) : Prop := forall x y, x <= y -> a * (y - x) <= f y - f x <= b * (y - x).
